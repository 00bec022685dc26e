"""Columns, kinds and codes shared by all kernels: the memory layout of paths.

A chain is an ordered list of nodes between two fixed end points. All that concerns a node stands in one row of one
float64 array `node` (N, ROW): one argument instead of seven, because numba hands an array on as seven numbers. A row
holds, in this order:

    KIND        VIA, CYLINDER, SPHERE, ...
    DIM   (4)   sizes of the surface [m], in the order of its class in `mjwrap/surfaces/primitives.py`
    SIZE        length by which steps on the surface are limited, about its smallest radius of curvature [m]
    POS   (3)   position of the surface frame S (or of the via point) in the world W [m]
    ROT   (9)   R_WS, row-major
    HINT  (4)   flag (0 or 1), then the hint in S [m]
    S_... (11)  the saved solution: what a warm start needs, nothing else
    W_...       scratch and results of the last evaluation, world frame relative to the path's first point
"""

KIND = 0
DIM = 1
SIZE = 5
POS = 6
ROT = 9
HINT = 18

# ----------------------------------------------------------------------------------------- kinds of nodes
VIA = 0
CYLINDER = 1  # DIM: radius, half length (infinite: inf)
SPHERE = 2  # DIM: radius
ELLIPSOID = 3  # DIM: three semi-axes
ELLIPTIC_CYLINDER = 4  # DIM: two semi-axes, half length
TORUS = 5  # DIM: major radius, minor radius
CONE = 6  # DIM: radius at z = 0, slope (radius gained per length along z), half length
CAPSULE = 7  # DIM: radius, half length of the cylinder
CUSTOM = 8  # DIM: radius about the origin that holds it (inf: unbounded), three addresses, see `custom.py`

# --------------------------------------------------------------------------------------------- statuses
CONVERGED = 0
NOT_CONVERGED = 1
ENDPOINT_INSIDE = 2
NOT_MINIMAL = 3
PENETRATING = 4
NON_FINITE = 5
OUT_OF_RANGE = 6
NO_GEODESIC = 7

# ------------------------------------------------------------------------ columns of the saved solution
S_MODE = 22  # COLD, FREE or TOUCHED
S_SWEEP = 23  # angle swept about a cylinder's axis from the node before to the node after, with sign [rad]
S_P = 24  # first contact point P in S (3) [m]; FREE, no closed form: where the straight segment starts
S_T = 27  # unit tangent at P in S (3); FREE, no closed form: where the straight segment ends [m]; zeros: not known
S_ARC = 30  # arc length s [m]
S_BEFORE = (
    31  # lengths of the straight segments that meet P and leave Q, where the path was found last (2) [m]
)
STATE = 11  # how many they are

COLD = -1.0
FREE = 0.0
TOUCHED = 1.0

# -------------------------------------------------------------------- columns of results and scratch
W_P = 33  # P (3), then Q, t_P, t_Q, n_P, n_Q, b_P, b_Q (3 each)
W_Q = 36
W_TP = 39
W_TQ = 42
W_NP = 45
W_NQ = 48
W_BP = 51
W_BQ = 54
W_KP = 57  # kappa, tau, beta at P
W_KQ = 60  # kappa, tau, beta at Q
W_JAC = 63  # Jacobi fields a, a', r, r' at Q
W_E = 67  # unit vector of the straight segment that arrives at P (3)
W_L = 70  # its length [m]
W_CP = 71  # e.t, e.n, e.b at P (3): the last two are rows 0 and 1 of the path error h
W_CQ = 74  # e'.t, e'.n, e'.b at Q (3), for the segment that leaves: the last two are rows 2 and 3 of h
W_LQ = 77  # length of the segment that leaves [m]
W_EQ = 78  # its unit vector (3)
W_Y = 81  # block elimination: solution for the right-hand side, in the end the Newton step d0..d3 (4)
W_X = 85  # block elimination: solution for the upper coupling (4 x 2)
W_SAVE = 93  # P, t, s before a trial step (7)
W_OLD = 100  # the saved solution from which the solve started (11)
W_KMIN = 111  # negative where the normal curvature is negative on the way: a string lifts off there [1/m]
W_RMIN = 112  # smallest of r over the arc so far: <= 0 behind a conjugate point
W_ANGLE = 113  # about the axis from P to Q [rad]; torus: how often the hole is passed; CUSTOM: 1 out of range, else 0
TWIN = 114  # 1 in the second row of a surface that a string may touch twice, 0 else
W_LAST = 115  # the saved solution before a single wrap (11)
W_FRESH = (
    126  # ||f||^2 of a single wrap just found, whose evaluation the row still holds; -1 where there is none
)
W_BEST = 127  # the shortest solution that several cold starts have found (11)
W_START = 138  # the saved solution from which a solve over a large move started (11)
W_LOW = 149  # height of the lowest point of a free string over the surface [m]
W_FIRST = 150  # in a span's first row: ||f||^2 of the contacts from which it started; -1 where they are not evaluated
W_REPAIRS = 151  # in a span's first row: how often the path was begun anew, from another start or in strides
W_PIN = 152  # 1 where the path ends on the surface, at Q: then h holds components of Q - B; 0 else
W_LAND = 153  # 1 while Q is to go to that end, however far it is (`end_on_surface.py`); 0 else
INSIDE = (
    154  # 1 where the string is held to the solid, alone between two fixed points (`held_inside.py`); 0 else
)
ROW = 160  # 20 cache lines

# ------------------------------------------------------------------------- columns of a chain's `info`
I_LENGTH = 0
I_STATUS = 1
I_ERROR = 2  # tangency error, the norm of f over all touched obstacles (30)
I_ITERATIONS = 3
I_EVALUATIONS = 4
I_SPEED = 5  # lengthening speed, of routes whose bodies move [m/s]
INFO = 6
