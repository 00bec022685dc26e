"""How kernels are compiled and linked by numba, and where their machine code is kept on the disk."""
