"""Templates of generated modules: geodesic, projection, height; `generate.py` reads them as text."""
