"""What the viewer opens with: the model in 3D beside the muscles' curves, in pages where there are many."""

import numpy as np
import rerun.blueprint as rrb

from mjwrap.recording.columns import TIMELINE
from mjwrap.recording.scene import SERIES_COLORS, Scene

PAGE = len(SERIES_COLORS)  # muscles to a page of plots, each with a colour of its own
TITLES = {
    "length": "length [m]",
    "velocity": "lengthening speed [m/s]",
    "tension": "tension [N]",
    "activation": "activation",
}


def blueprint(scene: Scene, points: np.ndarray, bodies: np.ndarray) -> rrb.Blueprint:
    """3D view looking at the muscles, and time series, a tab a page.

    Points of the muscles' paths (m, 3) and positions of the bodies (k, 3) [m] are those of the first frame.
    """
    space = rrb.Spatial3DView(
        origin="/world",
        name="model",
        contents="$origin/**",
        eye_controls=_eye(points, bodies),
        overrides={path: rrb.EntityBehavior(visible=False) for path in scene.hidden},
    )
    pages = [_page(scene, first) for first in range(0, len(scene.muscle_names), PAGE)]
    curves = pages[0] if len(pages) == 1 else rrb.Tabs(contents=pages, active_tab=0)
    return rrb.Blueprint(
        rrb.Horizontal(space, curves, column_shares=[3, 2]) if pages else space,
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, play_state="playing", loop_mode="all"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )


def _page(scene: Scene, first: int) -> rrb.Vertical:
    """Plots of all quantities of up to `PAGE` muscles."""
    names = scene.muscle_names[first : first + PAGE]
    views = [
        rrb.TimeSeriesView(
            origin=f"/{quantity}",
            name=title,
            contents=[f"+ /{path}" for path in scene.series[quantity][first : first + PAGE]],
            plot_legend=rrb.PlotLegend("RightTop", visible=quantity == "length"),
            axis_y=rrb.ScalarAxis(range=(0.0, 1.0)) if quantity == "activation" else None,
        )
        for quantity, title in TITLES.items()
    ]
    title = names[0] if len(names) == 1 else f"{names[0]} … {names[-1]}"
    return rrb.Vertical(contents=views, row_shares=[1.3, 1, 1, 1], name=title)  # room for the legend


def _eye(points: np.ndarray, bodies: np.ndarray) -> rrb.EyeControls3D | None:
    """An eye that looks along the direction in which the muscles are thinnest, from the side with fewer bodies."""
    if len(points) < 2:
        return None
    low, high = points.min(axis=0), points.max(axis=0)
    target, size = 0.5 * (low + high), float(np.linalg.norm(high - low))
    if size == 0:
        return None
    axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    level = np.array([*axes[-1][:2], 0.0])
    if len(axes) < 3 or np.linalg.norm(level) < 0.3:  # no thinnest direction, or the vertical: from the front
        level = np.array([0.0, 1.0, 0.0])
    level /= np.linalg.norm(level)
    if (bodies.mean(axis=0) - target) @ level > 0:
        level = -level
    eye = target + 1.35 * size * (level + np.array([0.0, 0.0, 0.35]))
    return rrb.EyeControls3D(position=eye, look_target=target, eye_up=[0.0, 0.0, 1.0])
