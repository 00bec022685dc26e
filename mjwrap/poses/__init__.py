"""Poses of a model: sweeps of joints over their ranges, random ones, and jumps along them."""
