"""Named groups of the arrays with the inputs and results of all muscles' paths.

Arrays named as in MuJoCo's mjData and mjModel have their shapes and frames.
"""

from __future__ import annotations

from typing import NamedTuple

from mjwrap.kernels.array_types import FloatRows, Floats, Indices, IntRows, Ints


class Routes(NamedTuple):
    """Routes of muscles: chains of nodes. A muscle has one, or several that pulleys join."""

    rows: IntRows  # (C, ROUTE), columns R_... of `muscle_paths.py`
    weights: Floats  # (C,) share of a route in its muscle's length
    links: IntRows  # (N, 4), columns L_...: what each node stands for in the model


class Poses(NamedTuple):
    """Positions and velocities of sites, geoms and bodies, from MuJoCo."""

    site_xpos: FloatRows  # (nsite, 3)
    geom_xpos: FloatRows  # (ngeom, 3)
    geom_xmat: FloatRows  # (ngeom, 9)
    cvel: FloatRows  # (nbody, 6)
    subtree_com: FloatRows  # (nbody, 3)
    xipos: FloatRows  # (nbody, 3)
    body_rootid: Ints  # (nbody,)


class Paths(NamedTuple):
    """Solved paths: rows of nodes for the next warm start, straight segments, and results for each route."""

    node: FloatRows  # (N, ROW), see `layout.py`
    segments: FloatRows  # (N + C, SEGMENT), see `solved/segments.py`
    count: Ints  # (C,) segments of each route
    info: FloatRows  # (C, INFO)


class PathPoints(NamedTuple):
    """Sites that move within their bodies, and routes that hold only in ranges of joints, see `path_points.py`."""

    axes: IntRows  # (A, AXIS) axes along which sites move
    numbers: Floats  # of the functions that say how
    uses: IntRows  # (U, USE) where routes pass these sites
    conditions: IntRows  # (K, CONDITION)
    ranges: FloatRows  # (K, 2) of joint positions, both ends included
    slopes: (
        FloatRows  # (A, SLOPE) result: derivatives of the sites' positions with respect to the joints, world
    )
    active: Ints  # (C,) result: 1 for routes that hold at the present pose
    force: Floats  # (nv,) result: generalised forces on the joints that move points


class SiteFrames(NamedTuple):
    """What places sites in the world, from MuJoCo."""

    qpos: Floats
    qvel: Floats
    xpos: FloatRows  # (nbody, 3)
    xmat: FloatRows  # (nbody, 9)
    site_pos: FloatRows  # (nsite, 3)


class Dofs(NamedTuple):
    """MuJoCo's tree of degrees of freedom and their motion axes."""

    last_dof: Ints  # (nbody,) the last dof that moves a body, -1 if there is none
    parent: Ints  # (nv,) dof_parentid
    body_rootid: Ints  # (nbody,)
    cdof: FloatRows  # (nv, 6)
    subtree_com: FloatRows  # (nbody, 3)


class Transmissions(NamedTuple):
    """MuJoCo's own actuators, and their tendons, that get length, velocity and moment from mjwrap's paths."""

    output: (
        Ints  # (n,) the actuator's row in rownnz, rowadr and moment; -1 for a muscle that applies wrenches
    )
    tendon: Ints  # (n,) the tendon that gets the path's length and Jacobian too, -1 if there is none
    tendon_row: Ints  # (n,) start of the tendon's row in ten_j
    gear: FloatRows  # (outputs, 6)
    actuator_length: Floats
    actuator_velocity: Floats
    rownnz: Indices  # rows of the sparse moment; their columns contain every dof that changes the path
    rowadr: Indices
    colind: Indices
    moment: Floats
    ten_length: Floats
    ten_velocity: Floats
    ten_j: Floats
