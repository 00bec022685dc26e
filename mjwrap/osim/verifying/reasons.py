"""Reasons for differences of lengths and moment arms that the numbers themselves show; none is a guess."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mjwrap.osim.verifying.imported import ImportedNumbers
from mjwrap.osim.verifying.lone_surfaces import closed_form_length
from mjwrap.osim.verifying.opensim_paths import STEP
from mjwrap.osim.verifying.reference import PoseNumbers
from mjwrap.osim.verifying.stops import Point, Touched, TouchingRoute

LARGE = 1e-3  # [m] a difference of length or moment arm that needs a reason
BENT = 0.02  # sine of the angle at which a straight line meets a surface, from which a path is not taut
JUMP = 1e-4  # [m] a change of length over a move of 1e-4 rad that is a jump
SHORT_ARC = 1e-6  # [m] an arc shorter than its chord by more is wrong
SAME = 1e-9  # [m] within which a geodesic is confirmed by another
BEYOND = 1e-6  # [m] by which a contact lies beyond the end of a cylinder
UNEXPLAINED = "not explained"

Geodesic = Callable[[TouchingRoute], float | None]


def length_reason(
    name: str, pose: PoseNumbers, ours: ImportedNumbers, gap: float, geodesic: Geodesic | None
) -> str:
    """Return why mjwrap's path is longer than OpenSim's by `gap` [m], as far as it can be seen.

    geodesic: returns the length of another program's geodesic over the stops of a route, or None.
    """
    contacts = pose.wraps.get(name, {})
    if name in ours.statuses:
        return f"mjwrap has no path: {ours.statuses[name]}"
    routes = [route for route in ours.routes if route.muscle == name]
    return (
        _short_arc(contacts)
        or _other_segment(pose.segments.get(name, {}), routes)
        or _beyond_end(contacts, routes, pose.lengths[name])
        or _not_taut(contacts)
        or _jump(pose.slopes.get(name, {}))
        or _confirmed(routes, geodesic)
        or _touches(contacts, ours.touched[name])
        or f"{UNEXPLAINED}: the geodesic is {'longer' if gap > 0 else 'shorter'}"
    )


def arm_reason(name: str, coordinate: str, arm: float, own: float, pose: PoseNumbers) -> str:
    """Return a reason why moment arms differ that OpenSim's own lengths give, or an empty string."""
    sides = pose.slopes.get(name, {}).get(coordinate)
    if sides is None:
        return ""
    slope = -0.5 * (sides[0] + sides[1])
    if abs(slope - arm) <= 0.5 * abs(own - arm):
        return ""
    near = ", and mjwrap's is" if abs(slope - own) <= LARGE else ""
    return f"OpenSim's moment arm is not the slope of its own length{near}"


def _short_arc(contacts: dict[str, list[float]]) -> str:
    short = [o for o, (arc, chord, _) in contacts.items() if arc < chord - SHORT_ARC]
    return f"OpenSim's arc is shorter than its own chord on {', '.join(short)}" if short else ""


def _not_taut(contacts: dict[str, list[float]]) -> str:
    bent = {o: kink for o, (_, _, kink) in contacts.items() if kink > BENT}
    which = ", ".join(
        f"{o} at {np.degrees(np.arcsin(min(sine, 1.0))):.1f} degrees" for o, sine in bent.items()
    )
    return (
        f"OpenSim's path is not taut: its straight line meets {which}, where a string is tangent"
        if bent
        else ""
    )


def _jump(slopes: dict[str, list[float]]) -> str:
    for coordinate, sides in slopes.items():
        jump = max(map(abs, sides)) * STEP
        if jump > JUMP:
            return f"OpenSim's length jumps by {1e3 * jump:.2f} mm as {coordinate} moves by {STEP:g}"
    return ""


def _other_segment(segments: dict[str, list[str]], routes: list[TouchingRoute]) -> str:
    """Return that a surface acts between other path points in OpenSim than in mjwrap."""
    for route in routes:
        for k, stop in enumerate(route.stops):
            if isinstance(stop, Point) or stop.name not in segments:
                continue
            before = next(s.name for s in route.stops[k::-1] if isinstance(s, Point))
            after = next(s.name for s in route.stops[k:] if isinstance(s, Point))
            theirs = [name.replace(" ", "_") for name in segments[stop.name]]
            if not all(mine.endswith(other) for mine, other in zip((before, after), theirs, strict=True)):
                return (
                    f"{stop.name} acts on another segment: in OpenSim between {theirs[0]} and {theirs[1]}, in mjwrap "
                    f"between {before} and {after}"
                )
    return ""


def _beyond_end(contacts: dict[str, list[float]], routes: list[TouchingRoute], theirs: float) -> str:
    """Return that a contact lies beyond the end of a cylinder that OpenSim's path does not wrap, and whether the path
    without it has OpenSim's length [m]."""
    for route in routes:
        for stop in route.stops:
            if isinstance(stop, Touched) and stop.name not in contacts:
                beyond = float(np.abs(stop.contact[:, 2]).max()) - stop.half
                if beyond > BEYOND:
                    without = closed_form_length(
                        replace(route, stops=[s for s in route.stops if s is not stop])
                    )
                    same = without is not None and abs(without - theirs) <= SAME
                    return (
                        f"mjwrap's path touches {stop.name} {1e3 * beyond:.2g} mm beyond the end of OpenSim's "
                        f"cylinder; mjwrap's has no ends"
                        + "; without it the path has OpenSim's length"
                        * same
                    )
    return ""


def _confirmed(routes: list[TouchingRoute], geodesic: Geodesic | None) -> str:
    """Return that another method finds mjwrap's length, for every route that touches something."""
    if not routes:
        return ""
    closed = [closed_form_length(route) for route in routes]
    gaps = [
        abs(other - route.length) for other, route in zip(closed, routes, strict=True) if other is not None
    ]
    if len(gaps) == len(routes) and max(gaps) <= SAME:
        return (
            f"OpenSim's path is not a geodesic: the closed form of a string over one cylinder or sphere has mjwrap's "
            f"length, within {max(max(gaps), 1e-16):.0e} m"
        )
    if geodesic is None:
        return ""
    others = [geodesic(route) for route in routes]
    gaps = [
        abs(other - route.length) for other, route in zip(others, routes, strict=True) if other is not None
    ]
    if len(gaps) == len(routes) and max(gaps) <= SAME:
        return (
            "OpenSim's classic path is not a geodesic: OpenSim's Scholz2015GeometryPath has mjwrap's length"
        )
    return ""


def _touches(contacts: dict[str, list[float]], count: int) -> str:
    if contacts and not count:
        return f"OpenSim wraps {', '.join(contacts)}; the geodesic has lifted off"
    if count and not contacts:
        return "the geodesic touches a surface that OpenSim's path does not wrap"
    if count != len(contacts):
        return f"the geodesic touches {count} surfaces, OpenSim's path {len(contacts)}"
    return ""
