"""Wrapping surfaces: built-in ones, surfaces written by users as functions, and triangles for pictures."""

from mjwrap.surfaces.primitives import (
    Capsule,
    Cone,
    Cylinder,
    Ellipsoid,
    EllipticCylinder,
    Sphere,
    Torus,
)
from mjwrap.surfaces.surface import Surface

__all__ = ["Capsule", "Cone", "Cylinder", "Ellipsoid", "EllipticCylinder", "Sphere", "Surface", "Torus"]
