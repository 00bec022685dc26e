"""The layout of the viewer: the model in 3D beside the muscles' curves, in groups if there are many muscles."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from mjwrap.recording.columns import TIMELINE
from mjwrap.recording.groups import FREE
from mjwrap.recording.scene import PAGE, Scene
from mjwrap.recording.static_shapes import MESH

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
    "without_path": "muscles without a path",
}
LINE = 0.17  # height of a legend's line, as part of a small plot's
LEGEND = 16  # joints whose names fit beside their curves
SIDE = 6  # joints whose moment arms are shown together
MANY = 100  # number of muscles from which arrows of forces would hide too much
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


def blueprint(scene: Scene, first: First) -> rrb.Blueprint:
    """Return a 3D view of the muscles, and time series: one page, or a tab for each group and one for all groups."""
    hidden = [*scene.hidden, *_scenery(scene, first.size)]
    if len(scene.muscle_names) > MANY:
        hidden.append("world/forces")
    space = rrb.Spatial3DView(
        origin="/world",
        name="model",
        contents="$origin/**",
        eye_controls=_eye(scene, first),
        overrides={path: rrb.EntityBehavior(visible=False) for path in hidden},
    )
    curves = _curves(scene, first)
    return rrb.Blueprint(
        rrb.Horizontal(space, curves, column_shares=[1, 1]) if curves else space,
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, play_state="playing", loop_mode="all"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )


def _curves(scene: Scene, first: First) -> rrb.Container | None:
    tabs: list[rrb.Container] = []
    for group, pages in zip(scene.groups, scene.pages, strict=True):
        grids = [_page(scene, page, first, _title(scene, page)) for page in pages]
        tabs.append(grids[0] if len(grids) == 1 else rrb.Tabs(contents=grids, active_tab=0))
        tabs[-1].name = group.name
    if len(tabs) > 1:
        tabs.insert(0, _overview(scene))
    if len(scene.coordinates) > 1:
        tabs.append(_moment_arms(scene))
    if len(scene.joints) > 1:
        tabs.append(_joints(scene))
    if not tabs:
        return None
    tabs.append(_solver(scene))
    return rrb.Tabs(contents=tabs, active_tab=0)


def _plot(
    entities: Iterable[str], title: str, *, legend: bool = False, unit: bool = False, origin: str = "/"
) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        origin=origin,
        name=title,
        contents=[f"+ /{path}" for path in entities],
        plot_legend=rrb.PlotLegend("LeftTop", visible=legend),
        axis_y=rrb.ScalarAxis(range=(0.0, 1.0)) if unit else None,
    )


def _grid(views: Sequence[rrb.View], name: str, names: int = PAGE) -> rrb.Container:
    """Return two columns of plots, with space for a legend of `names` lines in the first row; one column if few."""
    if len(views) <= 3:
        return rrb.Vertical(contents=views, name=name)
    shares = [max(1.3, LINE * names + 0.4)] + [1.0] * ((len(views) - 1) // 2)
    return rrb.Grid(contents=views, grid_columns=2, row_shares=shares, name=name)


def _overview(scene: Scene) -> rrb.Container:
    """Return the curves of whole groups."""
    views = [
        _plot(scene.group_series[q], title, legend=q == "activation", unit=q == "activation")
        for q, title in GROUP_TITLES.items()
    ]
    legend = max(2.4, 1.5 * LINE * len(scene.groups))
    return rrb.Vertical(contents=views, row_shares=[legend, 1, 1, 1], name="all groups")


def _page(scene: Scene, page: list[int], first: First, name: str) -> rrb.Container:
    """Return plots of all quantities of up to `PAGE` muscles, and of their largest moment arms."""
    views: list[rrb.View] = [
        _plot((scene.series[q][i] for i in page), TITLES[q], legend=q == "activation", unit=q == "activation")
        for q in TITLES
        if q in scene.series and q not in ("status", "iterations")
    ]
    views += _main_joint(scene, page, first)
    if len(views) % 2:
        views.append(_plot((scene.series["iterations"][i] for i in page), TITLES["iterations"]))
    return _grid(views, name, len(page))


def _main_joint(scene: Scene, page: list[int], first: First) -> list[rrb.View]:
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
        name=f"moment arm about {coordinate.name} [m]",
        contents=[f"+ /{path}"],
        plot_legend=rrb.PlotLegend("LeftTop", visible=False),
        overrides={path: rr.SeriesLines.from_fields(visible_series=shown)},
    )
    if best not in scene.joints:
        return [view]
    return [view, _plot([scene.joints[best]], f"angle of {coordinate.name} [rad]")]


def _moment_arms(scene: Scene) -> rrb.Container:
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
                legend=len(scene.coordinates[k].muscles) <= PAGE,
            )
            for k in part
        ]
        pages.append(_grid(views, f"{scene.coordinates[part[0]].name} …"))
    if len(pages) > 1:
        return rrb.Tabs(contents=pages, active_tab=0, name="moment arms")
    pages[0].name = "moment arms"
    return pages[0]


def _joints(scene: Scene) -> rrb.Container:
    """Return plots of the joints' positions, angles and lengths separately."""
    views = []
    for turns, title in ((True, "joint angles [rad]"), (False, "positions of slides [m]")):
        shown = [path for k, path in scene.joints.items() if scene.coordinates[k].turns is turns]
        if shown:
            views.append(_plot(shown, title, legend=len(shown) <= LEGEND))
    return rrb.Vertical(contents=views, name="joints")


def _solver(scene: Scene) -> rrb.Container:
    """Return plots of the path solver's status and iterations."""
    views = [_plot(scene.series[q], TITLES[q]) for q in ("iterations", "status")]
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
    eye = target + 1.1 * size * (level + np.array([0.0, 0.0, 0.35]))
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
