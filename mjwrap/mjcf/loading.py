"""Load a model from a file; errors list the models that exist."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import mujoco

from mjwrap.errors import ModelError
from mjwrap.mjcf.names import listed


def read_model(path: str | os.PathLike[str]) -> mujoco.MjModel:
    """Load an MJCF or MJB file; `ModelError`, with MuJoCo's reason, if that fails.

    Warnings of MuJoCo become Python warnings.
    """
    file = Path(path)
    if not file.is_file():
        folder, what = (file, "is a folder") if file.is_dir() else (file.parent, "does not exist")
        if not folder.is_dir():
            raise ModelError(f"model file {file} does not exist, nor does the folder {folder}")
        there = sorted(p.name for p in folder.glob("*") if p.suffix in (".xml", ".mjb"))
        raise ModelError(f"model file {file} {what}; models in {folder}: {listed(there)}")
    if not os.access(file, os.R_OK):
        raise ModelError(f"model file {file} cannot be read: permission denied")
    load = mujoco.MjModel.from_binary_path if file.suffix == ".mjb" else mujoco.MjModel.from_xml_path
    with _collected_warnings() as found:
        try:
            model = load(os.fspath(file))
        except (ValueError, mujoco.FatalError) as error:
            reason = with_remedy(" ".join("; ".join([*found, str(error)]).split()))
            raise ModelError(f"{file} is not a model that MuJoCo can load: {reason}") from None
    for text in found:
        warnings.warn(f"{file}: {text}", stacklevel=2)
    return model


def with_remedy(reason: str) -> str:
    """Return MuJoCo's reason against a model, and what helps if it could not find a muscle's length range."""
    if "engthrange" not in reason and "ength range" not in reason:
        return reason
    return (
        f"{reason}. MuJoCo searches for a muscle's length range along its own tendon, which may jump; "
        "mw.set_length_ranges(spec) writes the ranges along mjwrap's paths into an MjSpec"
    )


@contextmanager
def _collected_warnings() -> Iterator[list[str]]:
    """Collect MuJoCo's warnings inside a with block; otherwise MuJoCo writes them to the working folder."""
    found: list[str] = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(found.append)
    try:
        yield found
    finally:
        mujoco.set_mju_user_warning(before)
