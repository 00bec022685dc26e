"""Compile surfaces from plain Python functions: source, derivatives, checks, machine code and its cache.

    build -> source, generate (-> symbols, specialise, extrapolation, lanes, templates), implicit | parametric, library

`build` makes a module of machine code from a user's functions; `mjwrap/surfaces/user.py` has the classes, and
`mjwrap/kernels/geometry/user_surface.py` calls the code by its address.
"""
