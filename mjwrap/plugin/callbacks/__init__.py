"""Compiled callbacks, which MuJoCo calls: numba functions on raw addresses, in which no Python runs."""
