"""Columns, kinds and codes shared by all kernels: the memory layout of paths.

A chain is an ordered list of nodes between two fixed end points. All data of a node stand in one row of one float64
array `node` (N, ROW): one array argument instead of many, as numba passes each array as seven numbers. A row holds, in
this order:

    KIND        VIA, CYLINDER, SPHERE, ...
    DIM   (4)   sizes of the surface, as listed at its kind below; lengths in [m]
    SIZE        about the smallest radius of curvature; limits steps on the surface, and scales tolerances [m]
    TRAITS      properties of the surface and of the row, as a sum of the bits below
    Z_LIMIT     half length along local z beyond which a contact is out of range [m]; infinite where there is none
    POS   (3)   position of the surface frame S (or of the via point) in the world W [m]
    ROT   (9)   R_WS, row-major
    HINT  (4)   flag (0: none; 1, or one of those below), then the hint in S [m]
    S_... (11)  the saved solution: all that a warm start needs
    W_...       scratch and results of the last evaluation, world frame relative to the path's first point
    HANDLE      address of further data of the surface, 0 where there are none
    HINT_TURN   angle swept about a cylinder's axis near which a hinted string starts, 0 where the hint itself decides

The columns KIND to Z_LIMIT, which are read most often, fill the row's first cache line.

Only `mjwrap/surfaces/rows.py` fills the columns of a surface, from the surface's class; of the traits only SIDED comes
from the obstacle. Kernels ask for traits (`geometry/traits.py`); only `geometry/dispatch.py` and `wraps/single.py`
compare kinds.

Surfaces with several contacts. A string may touch a surface with hollows more than once. Such a surface has as many
consecutive rows as its class says (`touches`). They are equal in all columns except TOUCH, which counts 0, 1, 2, ...,
and the S_ and W_ columns: each row has its own saved solution. `spans/lift_off_touchdown.py` moves contacts between a
row and the next one. So far two rows per surface are used and tested; the hint stands in the first.

Addresses. Addresses and handles stand in float64 columns, which hold every integer below 2**53. A user's surface
(CUSTOM) has the addresses of its three functions in DIM + 1 to DIM + 3. A surface that needs arrays, such as a mesh,
has their address or identifier in HANDLE, the same in all its rows; the owner of the rows keeps the arrays alive. On
another device addresses differ, so that a copy of the rows there needs new ones.
"""

KIND = 0
DIM = 1
SIZE = 5
TRAITS = 6
Z_LIMIT = 7
POS = 8
ROT = 11
HINT = 20

# ----------------------------------------------------------------------------------------- kinds of nodes
VIA = 0
CYLINDER = 1  # DIM: radius
SPHERE = 2  # DIM: radius
ELLIPSOID = 3  # DIM: three semi-axes
ELLIPTIC_CYLINDER = 4  # DIM: two semi-axes, infinity for the third
TORUS = 5  # DIM: major radius, minor radius
CONE = 6  # DIM: radius at z = 0, slope (radius gained per length along z)
CAPSULE = 7  # DIM: radius, half length of the cylinder
CUSTOM = 8  # DIM: radius of a sphere about the origin that contains it, or inf; three addresses (`user_surface.py`)
KINDS = 9  # one more than the largest

# ------------------------------------------------------------------------------ traits of surfaces, as bits
CLOSED_FORM = 1  # the wrap between two points has a closed form (`wraps/single.py`); else it is searched for
BRANCHED = 2  # the side on which a string passes is topological: S_SWEEP holds the angle that it sweeps
HOLLOW = 4  # a straight segment that is tangent to the surface may enter it elsewhere
ONE_SIDED = 8  # between two points there is at most one stable wrap, so that no hint or search is needed
RANDOM_STARTS = 16  # a cold start may try hints at random places, at distance SIZE from its origin
ELLIPSE_SECTIONS = 32  # an ellipsoid with semi-axes DIM, so that plane sections are ellipses
SIDED = 64  # the path passes on the side of the hint at every pose; of the first row of a surface (`wraps/sides.py`)

# ------------------------------------- values of INSIDE: the solid inside which a string is held; 0: none
ABOUT_POINT = 1.0  # a sphere
ABOUT_AXIS = 2.0  # a cylinder about z

# An end that lies less deep inside a surface than this share of its size lies on it, as far as can be known from a file
# with six digits: each coordinate of an end up to ten sizes away is rounded by 5e-5 sizes at most.
AS_WRITTEN = 1e-4

# ------------------------------------------------------------ values of the flag HINT, beside 0 and 1; all are positive
RANDOM_HINT = 2.0  # a hint that a search has drawn, and removes
UNMET_HINT = 3.0  # a hint that the path does not meet, once that is tested

# --------------------------------------------------------------------------------------------- statuses
CONVERGED = 0
NOT_CONVERGED = 1
ENDPOINT_INSIDE = 2
NOT_MINIMAL = 3
PENETRATING = 4
NON_FINITE = 5
OUT_OF_RANGE = 6
NO_GEODESIC = 7
UNKNOWN_SURFACE = 8

# ------------------------------------------------------------------------ columns of the saved solution
S_MODE = 24  # LOST, COLD, FREE or TOUCHED
S_SWEEP = 25  # angle swept about a cylinder's axis from the node before to the node after, with sign [rad]
S_P = (
    26  # first contact point P in S (3) [m]; LOST, or FREE and no closed form: start of the straight segment
)
S_T = 29  # unit tangent at P in S (3); LOST, or FREE and no closed form: its end [m], zeros: not known
S_ARC = 32  # arc length s [m]
S_BEFORE = 33  # lengths of the straight segments to P and from Q in the last path that was found (2) [m]
STATE = 11  # number of these columns

LOST = -2.0  # a cold start that has found no path: see `spans/lost_spans.py`
COLD = -1.0
FREE = 0.0
TOUCHED = 1.0

# -------------------------------------------------------------------- columns of results and scratch
W_P = 35  # P (3), then Q, t_P, t_Q, n_P, n_Q, b_P, b_Q (3 each)
W_Q = 38
W_TP = 41
W_TQ = 44
W_NP = 47
W_NQ = 50
W_BP = 53
W_BQ = 56
W_KP = 59  # kappa, tau, beta at P
W_KQ = 62  # kappa, tau, beta at Q
W_JAC = 65  # Jacobi fields a, a', r, r' at Q
W_E = 69  # unit vector of the straight segment that arrives at P (3)
W_L = 72  # its length [m]
W_CP = 73  # e.t, e.n, e.b at P (3): the last two are rows 0 and 1 of the path error h
W_CQ = 76  # e'.t, e'.n, e'.b at Q (3), for the segment that leaves: the last two are rows 2 and 3 of h
W_LQ = 79  # length of the segment that leaves [m]
W_EQ = 80  # its unit vector (3)
W_Y = 83  # block elimination: solution for the right-hand side, at last the Newton step δ0..δ3 (4)
W_X = 87  # block elimination: solution for the block above the diagonal (4 x 2)
W_SAVE = 95  # P, t, s before a trial step (7)
W_OLD = 102  # the saved solution from which the solve started (11)
W_KMIN = 113  # negative if the normal curvature is negative on the way, where a string lifts off [1/m]
W_RMIN = 114  # smallest ratio of the field r to the arc length on the way; <= 0 behind a conjugate point
W_ANGLE = 115  # angle about the axis from P to Q [rad]; torus: how many times the geodesic passes the hole
TOUCH = 116  # number of the row among the rows of its surface, from 0
W_LAST = 117  # the saved solution before a single wrap (11)
W_WRAP_ERROR = 128  # ||f||^2 of a single wrap just found and evaluated in this row; -1 where there is none
W_BEST = 129  # the shortest solution of several cold starts (11)
W_START = 140  # the saved solution from which a solve over a large move started (11)
W_CLEARANCE = 151  # height of the lowest point of a free string over the surface [m]
W_START_ERROR = 152  # in a span's first row: ||f||^2 of the contacts from which it started; -1: not evaluated
W_RESTARTS = 153  # in a span's first row: number of restarts and continuations of the last solve
W_END_ON_SURFACE = 154  # 1 if the path ends on the surface, at Q: rows 2 and 3 of h then hold Q - B
W_END_TARGET = 155  # 1 while Newton's method moves Q to an end on the surface from any distance
INSIDE = 156  # ABOUT_POINT or ABOUT_AXIS if a string between two fixed points is held inside the solid
HANDLE = 157
W_OUT = 158  # 1 where the geodesic leaves the ranges in which a user's surface is valid, 0 else
HINT_TURN = 159
ROW = 160  # 20 cache lines

# ------------------------------------------------------------------------- columns of a chain's `info`
I_LENGTH = 0
I_STATUS = 1
I_ERROR = 2  # tangency error, the norm of f over all touched obstacles (30)
I_ITERATIONS = 3
I_EVALUATIONS = 4
I_SPEED = 5  # lengthening speed, of routes whose bodies move [m/s]
INFO = 6
