"""Columns, kinds and codes shared by all kernels: the memory layout of paths.

A chain is an ordered list of nodes between two fixed end points. All that concerns a node stands in one row of one
float64 array `node` (N, ROW): one argument instead of seven halves the cost of a short path, because numba counts
references on every array that it hands on. A row holds, in this order:

    KIND        VIA, CYLINDER, SPHERE, ...
    DIM   (4)   sizes of the surface [m]
    POS   (3)   position of the surface frame S (or of the via point) in the world W [m]
    ROT   (9)   R_WS, row-major
    HINT  (4)   flag (0 or 1), then the hint in S [m]
    S_... (9)   the saved solution: what a warm start needs, nothing else
    W_...       scratch and results of the last evaluation, world frame relative to the path's first point
"""

KIND = 0
DIM = 1
POS = 5
ROT = 8
HINT = 17

# ----------------------------------------------------------------------------------------- kinds of nodes
VIA = 0
CYLINDER = 1
SPHERE = 2

# --------------------------------------------------------------------------------------------- statuses
CONVERGED = 0
NOT_CONVERGED = 1
ENDPOINT_INSIDE = 2
NOT_MINIMAL = 3
PENETRATING = 4
NON_FINITE = 5

# ------------------------------------------------------------------------ columns of the saved solution
S_MODE = 21  # COLD, FREE or TOUCHED
S_SWEEP = 22  # angle swept about a cylinder's axis from the node before to the node after, with sign [rad]
S_P = 23  # first contact point P in S (3) [m]
S_T = 26  # unit tangent at P in S (3)
S_ARC = 29  # arc length s [m]
STATE = 9  # how many they are

COLD = -1.0
FREE = 0.0
TOUCHED = 1.0

# -------------------------------------------------------------------- columns of results and scratch
W_P = 30  # P (3), then Q, t_P, t_Q, n_P, n_Q, b_P, b_Q (3 each)
W_Q = 33
W_TP = 36
W_TQ = 39
W_NP = 42
W_NQ = 45
W_BP = 48
W_BQ = 51
W_KP = 54  # kappa, tau, beta at P
W_KQ = 57  # kappa, tau, beta at Q
W_JAC = 60  # Jacobi fields a, a', r, r' at Q
W_E = 64  # unit vector of the straight segment that arrives at P (3)
W_L = 67  # its length [m]
W_CP = 68  # e.t, e.n, e.b at P (3)
W_CQ = 71  # e'.t, e'.n, e'.b at Q (3), for the segment that leaves
W_LQ = 74  # length of the segment that leaves [m]
W_EQ = 75  # its unit vector (3)
W_Y = 78  # block elimination: solution for the right-hand side (4)
W_X = 82  # block elimination: solution for the upper coupling (4 x 2)
W_SAVE = 90  # P, t, s before a trial step (7)
W_OLD = 97  # the saved solution from which the solve started (9)
ROW = 112  # 14 cache lines

# ------------------------------------------------------------------------- columns of a chain's `info`
I_LENGTH = 0
I_STATUS = 1
I_ERROR = 2  # tangency error, the norm of f over all touched obstacles (30)
I_ITERATIONS = 3
I_EVALUATIONS = 4
INFO = 5
