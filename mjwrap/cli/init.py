"""Write the declaration of a muscle along a route: text to paste into a model, or a whole model file.

MODEL is an MJCF file; it is not changed unless --in-place is given. The text has a tendon and an actuator for the
muscle, its parameters, and a tuple with its route. MuJoCo loads it without mjwrap.

The route is a list of stops, separated by commas. The first and the last are sites; other sites are via points. A stop
may be
  SITE                         a point of the path
  GEOM                         a surface to wrap: a cylinder, sphere, ellipsoid or capsule
  GEOM:SITE                    a surface that the path touches near a site, its hint
  GEOM:side=SITE               a surface that the path passes on the side of a site, at every pose
  GEOM@SHAPE=SIZE/SIZE         the geom's frame with another surface: torus=MAJOR/MINOR and others [m]
  GEOM@SHAPE=SIZE/SIZE:SITE    the same with a hint
  GEOM@finite                  a cylinder geom as long as it is drawn

--set gives the parameters of the law: max_isometric_force [N], optimal_fiber_length [m], tendon_slack_length [m],
pennation_angle [rad] and others for degroote_fregly_2016 and millard_2012, tendon_model=elastic for an elastic tendon;
optimal_force [N] for path_actuator; lengthrange=LOW,HIGH [m] and force [N] for mujoco. Without --law it is the
law whose parameters are given.

Examples:
  mjwrap init models/elbow/elbow.xml --muscle X --route BRA_origin,elbow_cylinder,BRA_insertion --set optimal_force=100
  mjwrap init arm.xml --muscle BIC --route origin,elbow@torus=.03/.01,insertion --set optimal_force=100 -o new.xml
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco

from mjwrap import insert_xml, muscle_xml
from mjwrap.cli.common.errors import UserError
from mjwrap.cli.common.output import open_output, say
from mjwrap.errors import ModelError
from mjwrap.files.atomic import PartFile
from mjwrap.mjcf.named_models import OWN, own_file
from mjwrap.mjcf.parameters import LAWS
from mjwrap.runs.models import load
from mjwrap.system import CableSystem

MOVED = 1e-9  # [m] a smaller moment arm is none


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    add = parser.add_argument
    add("model", metavar="MODEL", help="MJCF file")
    add("--muscle", required=True, metavar="NAME", help="name of the muscle")
    add("--route", required=True, metavar="STOP,STOP,...", help="stops of its path, in order: see above")
    add("--law", choices=tuple(LAWS), help="muscle law (default: the one whose parameters are given)")
    add("--set", nargs="+", action="extend", default=[], metavar="KEY=VALUE", help="parameters of the law")
    driver = parser.add_mutually_exclusive_group()
    driver.add_argument("--actuator", metavar="NAME", help="actuator of the model that drives the muscle (default: "
        "a new one)")  # fmt: skip
    driver.add_argument(
        "--no-actuator", action="store_true", help="a muscle whose excitation is set in Python"
    )
    files = parser.add_mutually_exclusive_group()
    files.add_argument("-o", "--out", metavar="FILE.xml", help="write the model with the muscle to this file")
    files.add_argument("--in-place", action="store_true", help="write it into MODEL itself")


@dataclass(frozen=True)
class InitSettings:
    """The settings of `mjwrap init`: those of `muscle_xml`, and out: the file to write, or None to print the text."""

    model: str
    muscle: str
    route: str
    law: str | None
    parameters: Mapping[str, str]
    actuator: str | None
    driven: bool
    out: str | None
    in_place: bool


def execute(options: argparse.Namespace) -> int:
    """Run the command and return its exit code."""
    return init(
        InitSettings(
            model=options.model,
            muscle=options.muscle,
            route=options.route,
            law=options.law,
            parameters=_parameters(options.set),
            actuator=options.actuator,
            driven=not options.no_actuator,
            out=options.out,
            in_place=options.in_place,
        )
    )


def _parameters(entries: Sequence[str]) -> dict[str, str]:
    found = {}
    for entry in entries:
        key, mark, value = entry.partition("=")
        if not mark or not key or not value:
            raise UserError(f"--set '{entry}': write KEY=VALUE, such as max_isometric_force=600")
        found[key] = value
    return found


def init(settings: InitSettings) -> int:
    """Write the declaration, test the model with it, report, and return the exit code."""
    if settings.model.startswith(OWN):
        raise UserError(
            f"'{settings.model}' is a model that comes with mjwrap: copy its file and name the copy: "
            f"{own_file(settings.model)}"
        )
    if not settings.model.lower().endswith(".xml"):
        raise UserError(
            f"'{settings.model}' is not an MJCF file (.xml), into which a muscle could be written"
        )
    model = load(settings.model)
    text = Path(settings.model).read_bytes().decode("utf-8-sig")
    fragment = muscle_xml(
        model,
        settings.muscle,
        settings.route,
        law=settings.law,
        parameters=settings.parameters,
        actuator=settings.actuator,
        driven=settings.driven,
    )
    whole = insert_xml(text, fragment)
    output = None
    if settings.out:
        output = open_output(settings.out, "--out", ".xml")
    elif settings.in_place:
        output = PartFile(settings.model, ".xml", option="--in-place")
    folder = Path(settings.out or settings.model).resolve().parent
    told = try_out(whole, folder, settings.actuator or settings.muscle)
    if output is None:
        say(fragment.rstrip("\n"))
        print(f"mjwrap init: {told}; paste the text before </mujoco>", file=sys.stderr)
        return 0
    output.write_text(whole)
    say(f"{output.path}: {told}")
    return 0


def try_out(text: str, folder: Path, muscle: str) -> str:
    """Compile a model's text in a folder, evaluate a muscle of it, and return length and moment arms in words.

    Raises `UserError` if MuJoCo or mjwrap cannot use the model.
    """
    try:
        handle, name = tempfile.mkstemp(suffix=".xml", prefix=".mjwrap_init_", dir=folder)
    except OSError as error:
        raise UserError(
            f"cannot test the model in '{folder}': {(error.strerror or str(error)).lower()}"
        ) from None
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        model = load(name)
    except ModelError as error:
        raise UserError(str(error).replace(name, "the model with the muscle")) from None
    finally:
        os.unlink(name)
    data = mujoco.MjData(model)
    found = CableSystem(model)[muscle]
    arms = found.moment_arms(data)
    parts = [f"{joint} {1e3 * arm:.4g} mm" for joint, arm in arms.items() if abs(arm) > MOVED]
    if found.status:
        return f"{muscle} has no path in the initial pose: {found.status.message}"
    about = f"moment arms: {', '.join(parts)}" if parts else "no joint moves it there"
    return f"{muscle} is {1e3 * found.length:.5g} mm long in the initial pose; {about}"
