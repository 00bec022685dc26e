"""Columns of `points` (nodes + 2, POINT_ROW): a row for each point of a path, from the origin to the insertion.

A node that is not touched has no row. `hessian.py` says what the columns are for.
"""

from __future__ import annotations

from mjwrap.kernels.compilation.jit import jit

D_SLOT = 0
D_TOUCHED = 1  # FIXED, TANGENT or CORNER
D_P = 2  # P from the pose's origin (3) [m]
D_Q = 5  # Q from the pose's origin (3) [m]
D_E = 8  # unit vector of the segment that arrives (3)
D_L = 11  # its length [m]
D_NP = 12  # n_P, n_Q, b_P, b_Q (3 each), in the order of the node row
D_NQ = 15
D_BP = 18
D_BQ = 21
D_R = 24  # Jacobi field r at Q [m]
D_KP = 25  # kappa, tau at P
D_KQ = 27  # kappa, tau at Q
D_COS = 29  # b_P . b_Q of the point before
D_FIELD = 30  # a + c r: Jacobi field at Q of a unit shift of P, where the path before P is free to move
D_PIVOT = 31  # 1 + c L of the segment that leaves
D_C = 32  # stiffness c behind Q [1/m]
D_U = 33  # difference of material velocities over the segment that arrives (3)
D_GP = 36  # slope of the energy at P and at Q, with the path before eliminated
D_GQ = 37
D_X = 38  # shift of P along b_P, of Q along b_Q
D_Y = 39
D_RATE = 40  # rate of e (3)
D_ROW = 43  # row of the node, counted from the chain's first one
POINT_ROW = 44

FIXED = 0.0  # origin, insertion, via point
TANGENT = 1.0  # a contact that the path meets and leaves along the surface
CORNER = 2.0  # a string held inside (`held_inside.py`), between two fixed points
# A corner uses some of the columns for other data.
D_T1 = D_BP  # directions in which the corner can slide (3 each): around and along a cylinder's axis
D_T2 = D_BQ
D_BEND = D_KP  # curvatures along them (2)
D_SLIDE = D_KQ  # slide of the corner (3); fills D_KQ and D_COS


@jit
def dot(points, i, left, j, right):
    """Return the dot product of two column triples of two points."""
    return (
        points[i, left] * points[j, right]
        + points[i, left + 1] * points[j, right + 1]
        + points[i, left + 2] * points[j, right + 2]
    )


@jit
def angular_velocity_along(i, column, twist, points):
    """Return the angular velocity of point i's body along the vector in `column`."""
    k = int(points[i, D_SLOT])
    return (
        twist[k, 3] * points[i, column]
        + twist[k, 4] * points[i, column + 1]
        + twist[k, 5] * points[i, column + 2]
    )
