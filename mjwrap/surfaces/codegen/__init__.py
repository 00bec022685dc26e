"""Surfaces from plain Python functions: their source, derivatives, checks, machine code and its place on the disk.

    build -> source, generate (-> symbols, specialise, runge_kutta, templates), implicit | parametric, library

`build` makes a module of machine code from a user's functions; `mjwrap/surfaces/user.py` has the classes, and
`mjwrap/kernels/geometry/user_surface.py` calls the code by its address.
"""
