"""MuJoCo's C library: its functions, where the fields of its structs lie, and copies of its models."""
