"""`mjwrap compare`: compare MuJoCo's tendons with mjwrap's paths."""
