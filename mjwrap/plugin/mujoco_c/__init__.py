"""Access to MuJoCo's C library: its functions, the layout of its structs, copies of its models."""
