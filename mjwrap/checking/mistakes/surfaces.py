"""Find wrapping surfaces that are probably not meant: placeholders, odd sizes, rings beside the path, collisions."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap.checking.mistakes.finding import Mistake, PossibleMistake, millimetres, muscle_of, quoted
from mjwrap.checking.mistakes.pose import Posed
from mjwrap.checking.mistakes.unread import is_read, tuple_elements
from mjwrap.mjcf import MuscleDeclaration, Node, name_of
from mjwrap.mjcf.conditional_points import holds
from mjwrap.mjcf.wrapping_geoms import SIZES, size_keys

Array = NDArray[np.float64]
OBJ = mujoco.mjtObj
TINY, HUGE = 5e-3, 10.0  # sizes of a surface, as shares of the size of the muscle that wraps it
FAR = 3.0  # distance of a surface from the nearest stop, less its own size, as a share of the muscle's size
ALONG = np.cos(
    np.radians(5.0)
)  # of the angle between an axis and the line between the stops before and after
RING, ENDLESS = "torus_size", ("cylinder_size", "elliptic_cylinder_size")
SHAPES = ("torus", "cone", "elliptic_cylinder")  # words in names of geoms that no geom type has


def surface_mistakes(posed: Posed) -> Iterator[PossibleMistake]:
    """Yield the findings about the surfaces of all muscles; of a geom that several muscles wrap only once."""
    told: set[tuple[Mistake, str]] = set()
    listed = _listed_geoms(posed.model)
    for i, muscle in enumerate(posed.muscles.declarations):
        touched = iter(posed.touched[i])
        for route in muscle.routes:
            here = holds(posed.model, route.when, posed.data.qpos)
            for node, *ends in route.geom_ends():
                touches = next(touched)
                if not here:
                    continue
                finding = _of_surface(posed, i, muscle, node, ends, touches, node.geom in listed)
                if finding is not None and (finding.kind, finding.element) not in told:
                    told.add((finding.kind, finding.element))
                    yield finding
    yield from _collisions(posed)


def _of_surface(
    posed: Posed, i: int, muscle: MuscleDeclaration, node: Node, ends: list[int], touched: bool, listed: bool
) -> PossibleMistake | None:
    model, surface = posed.model, node.surface
    assert surface is not None
    geom, size, shape = (
        quoted(model, "geom", node.geom),
        float(posed.sizes[i]),
        type(surface).__name__.lower(),
    )
    may_stand = listed and node.sizes < 0  # a tendon's geom is always wrapped as itself
    numeric = _numeric_of(model, node.geom) if may_stand else -1
    name = name_of(model, OBJ.mjOBJ_GEOM, node.geom).lower()
    word = next((w for w in SHAPES if w in name and f"{w}_size" != surface.numeric), "")
    if numeric >= 0 or (may_stand and word):
        meant = (
            quoted(model, "numeric", numeric) if numeric >= 0 else f"a numeric with '{word}_size' in its name"
        )
        return PossibleMistake(
            Mistake.PLACEHOLDER,
            geom,
            f"is wrapped by {muscle_of(model, muscle)} as a {shape} of {millimetres(surface.size)}, although "
            + (f"{meant} seems to give it another shape" if numeric >= 0 else f"its name speaks of a {word}"),
            f"list {meant} directly after the geom in the tuple",
        )
    if listed and surface.size < TINY * size:
        return PossibleMistake(
            Mistake.PLACEHOLDER if node.sizes < 0 else Mistake.SIZE,
            geom,
            f"is wrapped by {muscle_of(model, muscle)}, which is {millimetres(size)} long, as a {shape} of only "
            f"{millimetres(surface.size)}",
            "if it stands for another shape, list the numeric of that shape directly after it in the tuple; sizes are "
            "in metres",
        )
    if surface.size > HUGE * size:
        return PossibleMistake(
            Mistake.SIZE,
            geom,
            f"is a {shape} of {millimetres(surface.size)}, and {muscle_of(model, muscle)} that wraps it is only "
            f"{millimetres(size)} long",
            "check its size: sizes are in metres, and radii, not diameters",
        )
    centre = posed.poses.geom_xpos[node.geom]
    away = min(float(np.linalg.norm(posed.poses.site_xpos[end] - centre)) for end in ends) - max(
        (x for x in surface.dims if np.isfinite(x)), default=0.0
    )
    if away > FAR * size and not touched and np.isfinite(surface.dims).all():
        return PossibleMistake(
            Mistake.FAR_AWAY,
            geom,
            f"is {millimetres(away)} away from {muscle_of(model, muscle)}, which is {millimetres(size)} long",
            "check its position, and that it is in the right body",
        )
    chord = posed.poses.site_xpos[ends[1]] - posed.poses.site_xpos[ends[0]]
    axis = posed.poses.geom_xmat[node.geom].reshape(3, 3)[:, 2]
    along = abs(float(chord @ axis)) > ALONG * float(np.linalg.norm(chord)) > 0.0
    if along and surface.numeric in ENDLESS and not touched:
        return PossibleMistake(
            Mistake.AXIS,
            geom,
            f"is a {shape} whose axis, local z, runs along {muscle_of(model, muscle)}, which does not touch it",
            "turn the geom so that its axis runs across the path, such as zaxis='0 1 0'",
        )
    if surface.numeric == RING and posed.found[i] and not touched and not _threads(posed, i, node):
        return PossibleMistake(
            Mistake.RING,
            geom,
            f"is a ring that {muscle_of(model, muscle)} passes at the reference pose without touching it or "
            "running through its hole",
            "put a hint on the inner side of its tube (a site with prm='1' directly after it), and check its axis, "
            "which is local z",
        )
    return None


def _listed_geoms(model: mujoco.MjModel) -> set[int]:
    """Return the geoms that the tuples list, which alone can be given another shape."""
    elements = (
        each
        for index in range(model.ntuple)
        if is_read(model, index)
        for each in tuple_elements(model, index)
    )
    return {item for kind, item in elements if kind == int(OBJ.mjOBJ_GEOM)}


def _numeric_of(model: mujoco.MjModel, geom: int) -> int:
    """Return a numeric that gives a shape, is listed after no geom, and has the geom's name in its own; else -1."""
    name = name_of(model, OBJ.mjOBJ_GEOM, geom)
    used = {
        item
        for index in range(model.ntuple)
        for before, (kind, item) in _with_previous(tuple_elements(model, index))
        if kind == int(OBJ.mjOBJ_NUMERIC) and before in (int(OBJ.mjOBJ_GEOM), int(OBJ.mjOBJ_SITE))
    }
    for index in range(model.nnumeric):
        label = name_of(model, OBJ.mjOBJ_NUMERIC, index)
        if index not in used and size_keys(label) and name in label and name not in SIZES:
            return index
    return -1


def _with_previous(elements: list[tuple[int, int]]) -> Iterator[tuple[int, tuple[int, int]]]:
    before = -1
    for each in elements:
        yield before, each
        before = each[0]


def _threads(posed: Posed, i: int, node: Node) -> bool:
    """Return whether a straight segment of a muscle crosses the disc of a ring: z = 0 within its major radius."""
    turn = posed.poses.geom_xmat[node.geom].reshape(3, 3)
    local = (posed.straights(i) - posed.poses.geom_xpos[node.geom]) @ turn
    a, b = local[:, 0], local[:, 1]
    with np.errstate(invalid="ignore", divide="ignore"):
        share = a[:, 2] / (a[:, 2] - b[:, 2])
        crossing = (a[:, 2] > 0.0) != (b[:, 2] > 0.0)
        at = a + share[:, None] * (b - a)
        inside = np.hypot(at[:, 0], at[:, 1]) < node.surface.dims[0]  # pyright: ignore[reportOptionalMemberAccess]
    return bool((crossing & inside & np.isfinite(share)).any())


def _collisions(posed: Posed) -> Iterator[PossibleMistake]:
    """Yield a finding for every wrapping geom that another geom penetrates at the pose, and that pushes it away."""
    model = posed.model
    wrapping = {geom for muscle in posed.muscles.declarations for geom in muscle.geoms}
    able = {g for g in wrapping if model.geom_contype[g] or model.geom_conaffinity[g]}
    if not able:
        return
    data = mujoco.MjData(model)
    data.qpos[:] = posed.data.qpos
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_collision(model, data)
    told: set[int] = set()
    for contact in data.contact:
        if contact.dist >= 0.0 or contact.exclude:
            continue
        pair = [int(g) for g in contact.geom]
        for geom, other in (pair, pair[::-1]):
            if geom in able and geom not in told:
                told |= {geom, other}
                yield PossibleMistake(
                    Mistake.COLLIDES,
                    quoted(model, "geom", geom),
                    f"wraps muscles, but also collides with {quoted(model, 'geom', other)} at the reference pose, by "
                    f"{millimetres(-float(contact.dist))}, so that the bodies push each other apart",
                    'write contype="0" conaffinity="0" on a geom that is only for wrapping',
                )
