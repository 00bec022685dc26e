"""Write an OpenSim model as MJCF, in full precision, with a report on every element."""
