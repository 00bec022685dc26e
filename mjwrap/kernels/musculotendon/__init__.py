"""Musculotendon units: activation, the laws' curves, fibre and tendon in equilibrium, tension, energy."""
