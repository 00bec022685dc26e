"""The numerical core: functions on float64 arrays, compiled by numba; without MuJoCo, classes, input or output.

Rooms, from the top; each may import those below it (`lint-imports` checks that):

    coupling                   all muscles of a model: moments, wrenches on bodies (a muscle's force enters MuJoCo here)
    spans                      which obstacles are touched, on which side; from pose to pose
    solved                     results of a solved path: segments, forces, derivatives
    wraps                      one obstacle between two points
    tangency                   path error and its Jacobian (`path_error.py`), Newton's method, certificate
    geometry | musculotendon   surfaces, geodesics, a segment's clearance (`clearance.py`) | activation, fibre, tendon
    optimization               muscle activations that meet given moments
    compilation                how kernels are compiled and linked, and where their machine code is kept
    array_types                the types of arrays in named groups
    layout                     the columns of a path's rows

docs/derivation.md has the mathematics, and for every equation the function that computes it.
"""
