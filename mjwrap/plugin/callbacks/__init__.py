"""The compiled callbacks that MuJoCo calls: numba functions on raw addresses, without Python."""
