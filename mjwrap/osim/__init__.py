"""OpenSim models: read .osim files, and write them as MuJoCo models with geodesic muscles."""
