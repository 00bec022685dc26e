"""The physics: float64 arrays in, arrays out; compiled by numba; no MuJoCo, no classes, no input or output."""
