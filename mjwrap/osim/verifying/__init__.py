"""Verify an imported model against OpenSim: numbers of OpenSim itself, or numbers frozen from it, beside mjwrap's."""
