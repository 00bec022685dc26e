"""Geodesic muscles for MuJoCo: C1 paths over any number of wrapping surfaces."""

__version__ = "0.1.0"
