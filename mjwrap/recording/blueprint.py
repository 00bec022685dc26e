"""The layout of the viewer: the model in 3D beside the muscles' curves, in groups if there are many muscles."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from mjwrap.recording.axes import Bounds, common_range
from mjwrap.recording.columns import TIMELINE
from mjwrap.recording.groups import FREE
from mjwrap.recording.scene import PAGE, Scene
from mjwrap.recording.static_shapes import MESH, invisible, see_through

TITLES = {
    "activation": "activation",
    "tension": "tension [N]",
    "length": "length [m]",
    "velocity": "lengthening speed [m/s]",
    "fiber_length": "fibre length [m]",
    "power": "power on the bodies [W]",
    "iterations": "solver iterations",
    "status": "solver status (0: path found)",
}
GROUP_TITLES = {
    "activation": "mean activation",
    "tension": "sum of tensions [N]",
    "power": "sum of powers [W]",
    "without_path": "names; muscles without a path",
}
SHARES = [2, 3]  # widths of the model and of the plots
COLUMNS = 3  # of plots; with three rows each is tall enough for labelled ticks
ROOMY = 4  # so many plots or fewer stand in two columns
LEGEND_OF_GROUPS = "without_path"  # its plot is empty in most runs, and has the names
LEGEND = 16  # joints whose names fit beside their curves
SIDE = 6  # joints whose moment arms are shown together
MANY = 100  # number of muscles from which arrows of forces would hide too much
ROOM = 1.35  # distance of the eye, relative to the size of all muscles
SCENERY = 2.0  # a mesh of the world that is so many times larger than all muscles counts as scenery


class First(NamedTuple):
    """The first frame: points of all paths (m, 3), positions of bodies (nbody, 3) [m], |∂l/∂q| of coordinates."""

    points: np.ndarray
    bodies: np.ndarray
    arms: list[np.ndarray]

    @property
    def size(self) -> float:
        """Diagonal of the box around all paths [m], 0 if there is no path."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0))) if len(self.points) else 0.0


def blueprint(scene: Scene, first: First, bounds: Bounds) -> rrb.Blueprint:
    """Return a 3D view of the muscles, and time series: one page, or a tab for each group and one for all groups.

    bounds: least and largest values of the curves by entity, as far as they are known, for the ranges of axes.
    """
    unseen = [scene.geoms[i] for i in scene.wrapping if invisible(scene.model, i)]
    hidden = [*scene.hidden, *unseen, *_scenery(scene, first.size)]
    if len(scene.muscle_names) > MANY:
        hidden.append("world/forces")
    space = rrb.Spatial3DView(
        origin="/world",
        name="model",
        contents="$origin/**",
        eye_controls=_eye(scene, first),
        overrides=_looks(scene) | {path: rrb.EntityBehavior(visible=False) for path in hidden},
    )
    curves = _curves(scene, first, bounds)
    return rrb.Blueprint(
        rrb.Horizontal(space, curves, column_shares=SHARES) if curves else space,
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, play_state="playing", loop_mode="all"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )


def _curves(scene: Scene, first: First, bounds: Bounds) -> rrb.Container | None:
    tabs: list[rrb.Container] = []
    for group, pages in zip(scene.groups, scene.pages, strict=True):
        grids = [_page(scene, page, first, bounds) for page in pages]
        tabs.append(grids[0] if len(grids) == 1 else rrb.Tabs(contents=grids, active_tab=0))
        tabs[-1].name = group.name
    if len(tabs) > 1:
        tabs.insert(0, _overview(scene, bounds))
    if len(scene.coordinates) > 1:
        tabs.append(_moment_arms(scene, bounds))
    if len(scene.joints) > 1:
        tabs.append(_joints(scene, bounds))
    if not tabs:
        return None
    tabs.append(_solver(scene, bounds))
    return rrb.Tabs(contents=tabs, active_tab=0)


def _plot(
    entities: Iterable[str], title: str, bounds: Bounds, *, legend: bool = False, unit: bool = False
) -> rrb.TimeSeriesView:
    entities = list(entities)
    return rrb.TimeSeriesView(
        origin="/",
        name=title,
        contents=[f"+ /{path}" for path in entities],
        plot_legend=rrb.PlotLegend("LeftTop", visible=legend),
        axis_y=_axis((0.0, 1.0) if unit else common_range(bounds, entities)),
    )


def _axis(ends: tuple[float, float] | None) -> rrb.ScalarAxis | None:
    return None if ends is None else rrb.ScalarAxis(range=ends)


def _grid(views: Sequence[rrb.View], name: str) -> rrb.Container:
    """Return plots in as few rows as possible: the viewer labels the ticks of a plot only if it is tall."""
    columns = 1 if len(views) <= 2 else 2 if len(views) <= ROOMY else COLUMNS
    return rrb.Grid(contents=views, grid_columns=columns, name=name)


def _overview(scene: Scene, bounds: Bounds) -> rrb.Container:
    """Return the curves of whole groups."""
    views = [
        _plot(scene.group_series[q], title, bounds, legend=q == LEGEND_OF_GROUPS, unit=q == "activation")
        for q, title in GROUP_TITLES.items()
    ]
    return _grid(views, "all groups")


def _page(scene: Scene, page: list[int], first: First, bounds: Bounds) -> rrb.Container:
    """Return plots of all quantities of up to `PAGE` muscles, of their largest moment arms, and with their names."""
    views: list[rrb.View] = [
        _plot((scene.series[q][i] for i in page), TITLES[q], bounds, unit=q == "activation")
        for q in TITLES
        if q in scene.series and q not in ("status", "iterations")
    ]
    views += _main_joint(scene, page, first, bounds)
    # the names stand where they hide the least
    names = f"names; {TITLES['iterations']}"
    views.append(_plot((scene.series["iterations"][i] for i in page), names, bounds, legend=True))
    return _grid(views, _title(scene, page))


def _main_joint(scene: Scene, page: list[int], first: First, bounds: Bounds) -> list[rrb.View]:
    """Return plots of a page's moment arms about the coordinate for which their sum is largest; none if none cross."""
    best, best_sum = -1, 0.0
    for k, (coordinate, arms) in enumerate(zip(scene.coordinates, first.arms, strict=False)):
        total = float(arms[np.isin(coordinate.muscles, page)].sum())
        if coordinate.turns and not coordinate.follows and total > best_sum:
            best, best_sum = k, total
    if best < 0:
        return []
    coordinate, path = scene.coordinates[best], scene.moment_arms[best]
    shown = [i in page for i in coordinate.muscles]
    view = rrb.TimeSeriesView(
        origin="/",
        name=f"moment arm [m] about {coordinate.name}",
        contents=[f"+ /{path}"],
        plot_legend=rrb.PlotLegend("LeftTop", visible=False),
        axis_y=_axis(common_range(bounds, [path], shown)),
        overrides={path: rr.SeriesLines.from_fields(visible_series=shown)},
    )
    if best not in scene.joints:
        return [view]
    return [view, _plot([scene.joints[best]], f"angle [rad] of {coordinate.name}", bounds)]


def _moment_arms(scene: Scene, bounds: Bounds) -> rrb.Container:
    """Return plots of the moment arms about every coordinate that can move, `SIDE` to a page."""
    free = [k for k, coordinate in enumerate(scene.coordinates) if not coordinate.follows]
    free = free or list(range(len(scene.coordinates)))
    pages = []
    for start in range(0, len(free), SIDE):
        part = free[start : start + SIDE]
        views = [
            _plot(
                [scene.moment_arms[k]],
                scene.coordinates[k].name + (" [m]" if scene.coordinates[k].turns else ""),
                bounds,
                legend=len(scene.coordinates[k].muscles) <= PAGE,
            )
            for k in part
        ]
        pages.append(_grid(views, f"{scene.coordinates[part[0]].name} …"))
    if len(pages) > 1:
        return rrb.Tabs(contents=pages, active_tab=0, name="moment arms")
    pages[0].name = "moment arms"
    return pages[0]


def _joints(scene: Scene, bounds: Bounds) -> rrb.Container:
    """Return plots of the joints' positions, angles and lengths separately."""
    views = []
    for turns, title in ((True, "joint angles [rad]"), (False, "positions of slides [m]")):
        shown = [path for k, path in scene.joints.items() if scene.coordinates[k].turns is turns]
        if shown:
            views.append(_plot(shown, title, bounds, legend=len(shown) <= LEGEND))
    return rrb.Vertical(contents=views, name="joints")


def _solver(scene: Scene, bounds: Bounds) -> rrb.Container:
    """Return plots of the path solver's status and iterations."""
    views = [_plot(scene.series[q], TITLES[q], bounds) for q in ("iterations", "status")]
    return rrb.Vertical(*views, rrb.TextLogView(origin="/solver", name="paths lost and found"), name="solver")


def _title(scene: Scene, page: list[int]) -> str:
    first, last = scene.muscle_names[page[0]], scene.muscle_names[page[-1]]
    return first if len(page) == 1 else f"{first} … {last}"


def _scenery(scene: Scene, size: float) -> list[str]:
    """Return the geoms that would hide the muscles: meshes of the world that are much larger than all muscles."""
    model = scene.model
    return [
        scene.geoms[i]
        for i in range(model.ngeom)
        if model.geom_bodyid[i] == 0
        and model.geom_type[i] == MESH
        and model.geom_rbound[i] > SCENERY * size > 0
    ]


def _looks(scene: Scene) -> dict[Any, Any]:
    """Return the first look of the geoms, by entity: nothing hides a muscle."""
    found: dict[Any, Any] = {}
    for i, path in enumerate(scene.geoms):
        look = see_through(scene.model, i, wraps=i in scene.wrapping)
        if look is not None:
            found[path] = look
    return found


def _eye(scene: Scene, first: First) -> rrb.EyeControls3D | None:
    """Return a camera that looks along the direction of the muscles' smallest extent, from the side with fewer bodies.

    The camera follows a body with muscles that moves freely in the world.
    """
    points, bodies, size = first.points, first.bodies[1:], first.size
    if len(points) < 2 or size == 0:
        return None
    target = 0.5 * (points.min(axis=0) + points.max(axis=0))
    axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    level = np.array([*axes[-1][:2], 0.0])
    if (
        len(axes) < 3 or np.linalg.norm(level) < 0.3
    ):  # no unique direction, or the vertical one: look from the front
        level = np.array([0.0, 1.0, 0.0])
    level /= np.linalg.norm(level)
    if len(bodies) and (bodies.mean(axis=0) - target) @ level > 0:
        level = -level
    eye = target + ROOM * size * (level + np.array([0.0, 0.0, 0.35]))
    return rrb.EyeControls3D(
        position=eye, look_target=target, eye_up=[0.0, 0.0, 1.0], tracking_entity=_followed(scene)
    )


def _followed(scene: Scene) -> str | None:
    """Return a geom of the body from which all muscles' bodies descend, if it moves freely, or of a body below it."""
    model = scene.model
    roots = {int(model.body_rootid[model.site_bodyid[muscle.origin_site]]) for muscle in scene.declarations}
    root = roots.pop() if len(roots) == 1 else 0
    if not (root > 0 and model.body_dofnum[root] == 6 and model.jnt_type[model.body_jntadr[root]] == FREE):
        return None
    geoms = np.flatnonzero(model.body_rootid[model.geom_bodyid] == root)
    seen = [f"/{scene.geoms[i]}" for i in geoms if scene.geoms[i] not in scene.hidden]
    return seen[0] if seen else None
