"""How a film shows muscles: told apart by colour or coloured by activation, with via points and wrapping surfaces.

MuJoCo and the plugin fill a scene first; the functions here change the geoms of that scene, and add to it.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjwrap import validation
from mjwrap.errors import RecordingError, StateError
from mjwrap.plugin import Muscles
from mjwrap.surfaces import Capsule, Cylinder, Ellipsoid, Sphere, Surface
from mjwrap.surfaces.triangles import surface_grid, triangles
from mjwrap.video.legend import Entry

MUSCLE, ACTIVATION, MODEL = COLORS = ("muscle", "activation", "model")
# told apart on light and on dark, also by most people who are colour-blind; repeated for more muscles
PALETTE = (
    np.array(
        [
            (214, 39, 40), (31, 119, 180), (44, 160, 44), (255, 127, 14), (148, 103, 189), (23, 170, 190),
            (227, 90, 170), (140, 86, 75), (188, 170, 20), (90, 90, 220), (0, 140, 110), (120, 120, 120),
        ]
    )
    / 255.0
)  # fmt: skip
RELAXED, ACTIVE = np.array([0.16, 0.31, 0.90]), np.array([0.90, 0.12, 0.12])  # as in recordings
VIA_COLOR = np.array([0.12, 0.12, 0.14])
VIA_ON_DARK = np.array([0.92, 0.92, 0.92])
CONTACT = "contact point"
BEAD = 1.2  # radius of a via point [radii of the path]
ALPHA = 0.35  # opacity of surfaces on request
LEGEND = 12  # more muscles than this have no legend by themselves
GLOW = 0.4  # of a floor without its texture, so that it is not dark where no light falls
AROUND, ALONG = 25, 17  # points of a surface that is drawn as triangles

_UNKNOWN, _GEOM, _TENDON, _ACTUATOR = (
    int(x)
    for x in (
        mujoco.mjtObj.mjOBJ_UNKNOWN,
        mujoco.mjtObj.mjOBJ_GEOM,
        mujoco.mjtObj.mjOBJ_TENDON,
        mujoco.mjtObj.mjOBJ_ACTUATOR,
    )
)
_CAPSULE, _SPHERE, _MESH = (
    int(x) for x in (mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_MESH)
)
_NONE = int(mujoco.mjtGeom.mjGEOM_NONE)
_KINDS: tuple[tuple[type[Surface], Any], ...] = (
    (Sphere, mujoco.mjtGeom.mjGEOM_SPHERE),
    (Cylinder, mujoco.mjtGeom.mjGEOM_CYLINDER),
    (Ellipsoid, mujoco.mjtGeom.mjGEOM_ELLIPSOID),
    (Capsule, mujoco.mjtGeom.mjGEOM_CAPSULE),
)
Array = NDArray[np.float64]


class MuscleLooks:
    """The muscles of an mjData in films; none if its model has no plugin.

    colors: "muscle", "activation", "model", or None for "muscle" where the model gives all its muscles one look, else
    "model". surfaces: whether wrapping surfaces are shown; None: as the model shows them.
    """

    def __init__(self, data: mujoco.MjData, colors: str | None, surfaces: bool | None, *, dark: bool) -> None:
        self._surfaces, self._dark = surfaces, dark
        try:
            self._muscles: Muscles | None = Muscles(data)
        except StateError:
            self._muscles = None
        declared = list(self._muscles.declarations) if self._muscles else []
        self._names = [muscle.name for muscle in declared]
        self._identity = {
            (_TENDON, muscle.tendon) if muscle.tendon >= 0 else (_ACTUATOR, muscle.actuator): i
            for i, muscle in enumerate(declared)
            if muscle.tendon >= 0 or muscle.actuator >= 0
        }
        alone = [i for i, muscle in enumerate(declared) if muscle.tendon < 0 and muscle.actuator < 0]
        if len(alone) == 1:  # the scene does not tell several of these apart
            self._identity[_UNKNOWN, -1] = alone[0]
        self._via = [muscle.via_sites for muscle in declared]
        self._wraps = {
            geom: surface
            for muscle in declared
            for geom, surface in zip(muscle.geoms, muscle.surfaces, strict=True)
        }
        self.colors = colors or (MUSCLE if len(declared) > 1 and _one_look(data.model, declared) else MODEL)

    def dress(self, scene: mujoco.MjvScene, data: mujoco.MjData) -> None:
        """Change a filled scene: colours of paths, via points, surfaces."""
        if self._muscles is None:
            return
        colors, radius, seen = self._colors(), np.zeros(len(self._names)), set()
        for k in range(scene.ngeom):
            geom = scene.geoms[k]
            kind, number = int(geom.objtype), int(geom.objid)
            if kind == _GEOM:
                if self._surfaces is not None and number in self._wraps:
                    self._show_or_hide(data.model, geom, number, seen)
                continue
            i = self._identity.get((kind, number), -1)
            if i >= 0 and geom.type == _CAPSULE:
                if colors is not None:
                    geom.rgba[:3] = colors[i]
                radius[i] = max(radius[i], float(geom.size[0]))
        self._add_via_points(scene, data, radius)
        if self._surfaces:
            for number in self._wraps.keys() - seen:
                _add_surface(scene, data, number, self._wraps[number])

    def legend(self) -> list[Entry]:
        """Return names and colours for a legend; none if colours say nothing."""
        entries: list[Entry] = []
        if self.colors == MUSCLE:
            told = sorted(self._identity.values())
            entries = [(self._names[i], PALETTE[i % len(PALETTE)], False) for i in told]
        elif self.colors == ACTIVATION and self._names:
            entries = [
                (f"activation {share:g}", RELAXED + share * (ACTIVE - RELAXED), False)
                for share in (0.0, 0.5, 1.0)
            ]
        if entries and any(self._via):
            entries.append(("via point", self._via_color, True))
        return entries

    @property
    def few(self) -> bool:
        """Whether all names fit in a legend."""
        return len(self._names) <= LEGEND or self.colors == ACTIVATION

    @property
    def _via_color(self) -> Array:
        return VIA_ON_DARK if self._dark else VIA_COLOR

    def _colors(self) -> Array | None:
        if self.colors == MUSCLE:
            return PALETTE[np.arange(len(self._names)) % len(PALETTE)]
        if self.colors == ACTIVATION and self._muscles is not None:
            share = np.clip(np.asarray(self._muscles.activation), 0.0, 1.0)[:, None]
            return RELAXED + share * (ACTIVE - RELAXED)
        return None

    def _show_or_hide(self, model: mujoco.MjModel, geom: Any, number: int, seen: set[int]) -> None:
        if not self._surfaces:
            geom.type = _NONE
        elif _has_shape(model, number, self._wraps[number]):
            geom.rgba[3] = min(float(geom.rgba[3]), ALPHA)
            seen.add(number)

    def _add_via_points(self, scene: mujoco.MjvScene, data: mujoco.MjData, radius: Array) -> None:
        """Add a sphere at each via point of the muscles that are seen, which have a radius [m]."""
        largest: dict[int, float] = {}
        for i in np.flatnonzero(radius):
            for site in self._via[i]:
                largest[site] = max(largest.get(site, 0.0), BEAD * float(radius[i]))
        for site, size in largest.items():
            _add(scene, _SPHERE, (size, size, size), data.site_xpos[site], np.eye(3), (*self._via_color, 1.0))


def check_colors(colors: str | None) -> None:
    """Raise RecordingError if a film has no colours of this name."""
    if colors is not None:
        validation.choice(colors, COLORS, "colors", RecordingError)


def hide(scene: mujoco.MjvScene, geoms: set[int]) -> None:
    """Take geoms of the model out of a filled scene."""
    for k in range(scene.ngeom):
        geom = scene.geoms[k]
        if geom.objtype == _GEOM and geom.objid in geoms:
            geom.type = _NONE


def pale_floors(scene: mujoco.MjvScene, color: Array) -> None:
    """Give planes a plain colour instead of their texture."""
    for k in range(scene.ngeom):
        geom = scene.geoms[k]
        if geom.type == int(mujoco.mjtGeom.mjGEOM_PLANE) and geom.objtype == _GEOM:
            geom.matid, geom.reflectance = -1, 0.0
            geom.rgba[:3], geom.emission, geom.specular = color, GLOW, 0.0


def _one_look(model: mujoco.MjModel, muscles: list[Any]) -> bool:
    looks = {
        (tuple(float(x) for x in model.tendon_rgba[m.tendon]), int(model.tendon_matid[m.tendon]))
        for m in muscles
        if m.tendon >= 0
    }
    return len(looks) <= 1  # one without a tendon has no look of its own


def _has_shape(model: mujoco.MjModel, geom: int, surface: Surface) -> bool:
    """Return whether a geom looks like its surface: it is of its kind, or a mesh made for it."""
    kind = int(model.geom_type[geom])
    return kind == _MESH or any(isinstance(surface, cls) and kind == int(form) for cls, form in _KINDS)


def _add_surface(scene: mujoco.MjvScene, data: mujoco.MjData, number: int, surface: Surface) -> None:
    """Add a wrapping surface in the frame of its geom, in the geom's colour and translucent."""
    model = data.model
    place, turn = data.geom_xpos[number], data.geom_xmat[number].reshape(3, 3)
    rgba = (*(float(x) for x in model.geom_rgba[number][:3]), ALPHA)
    own = [float(x) for x in model.geom_size[number]]
    for cls, form in _KINDS:
        if isinstance(surface, cls) and int(model.geom_type[number]) == int(form):
            _add(scene, int(form), own, place, turn, rgba)
            return
    vertices, faces = triangles(surface_grid(surface, AROUND, ALONG))
    corners = place + vertices @ turn.T
    for a, b, c in corners[faces]:
        normal = np.cross(b - a, c - a)
        area = float(np.linalg.norm(normal))
        if area > 0.0:
            frame = np.column_stack([b - a, c - a, normal / area])
            if not _add(scene, int(mujoco.mjtGeom.mjGEOM_TRIANGLE), (1.0, 1.0, 1.0), a, frame, rgba):
                return


def _add(scene: mujoco.MjvScene, kind: int, size: Any, place: Any, turn: Any, rgba: Any) -> bool:
    """Add a geom to a scene; return False if it is full."""
    if scene.ngeom >= scene.maxgeom:
        return False
    geom = scene.geoms[scene.ngeom]
    mujoco.mjv_initGeom(
        geom, kind, np.array(size, dtype=float), np.array(place, dtype=float), np.array(turn, dtype=float).ravel(),
        np.array(rgba, dtype=np.float32),
    )  # fmt: skip
    geom.category = int(mujoco.mjtCatBit.mjCAT_DECOR)
    geom.transparent = int(rgba[3] < 1.0)
    scene.ngeom += 1
    return True
