"""Kernels for many frames of a given motion."""
