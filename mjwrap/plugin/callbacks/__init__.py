"""What MuJoCo calls, compiled: numba functions on raw addresses, in which no Python runs."""
