"""Results of a solved path: straight segments, velocities, forces, derivatives, points to draw."""
