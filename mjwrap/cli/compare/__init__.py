"""`mjwrap compare`: MuJoCo's tendons beside mjwrap's paths."""
