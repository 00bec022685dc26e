"""The fixed part of generated modules: geodesic, projection, height; read as text by `generate.py`, never imported."""
