"""`mjwrap import`: turn an OpenSim model into a MuJoCo model, with a report."""
