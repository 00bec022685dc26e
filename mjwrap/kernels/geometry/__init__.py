"""Surfaces: nearest points, heights, clearance of segments, and geodesics with their Jacobi fields."""
