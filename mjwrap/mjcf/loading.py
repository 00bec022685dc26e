"""Load a model from a file or by name; errors list the models that exist."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import mujoco

from mjwrap.errors import ModelError
from mjwrap.mjcf.file_inertias import restore_inertias
from mjwrap.mjcf.file_kinds import foreign, opensim
from mjwrap.mjcf.missing_names import with_candidates
from mjwrap.mjcf.named_models import MYO, OWN, myo_model, myo_spec, own_file, own_models
from mjwrap.mjcf.names import listed
from mjwrap.text import nearest


def is_binary(path: str | os.PathLike[str]) -> bool:
    """Return whether a source of a model is an MJB file, which has no spec."""
    return os.fspath(path).lower().endswith(".mjb")


def read_spec(path: str | os.PathLike[str]) -> mujoco.MjSpec:
    """Return the spec of an MJCF file or of a model by name; `ModelError` as by `read_model`, and for an MJB file."""
    text = _source(path)
    if text.startswith(MYO):
        return myo_spec(text)
    read_model(text)  # raises an error if the file is wrong
    if is_binary(text):
        raise ModelError(f"'{text}' is an MJB file, which cannot be changed; give its XML instead")
    return mujoco.MjSpec.from_file(str(own_file(text)) if text.startswith(OWN) else text)


def read_model(path: str | os.PathLike[str]) -> mujoco.MjModel:
    """Load an MJCF or MJB file, or a model by name: "mjwrap:NAME", "myo_sim:NAME".

    Raises `ModelError`, with MuJoCo's reason, if that fails. Warnings of MuJoCo become Python warnings.
    Inertias that MuJoCo's compiler refuses are those of the file again (`restore_inertias`).
    """
    text = _source(path)
    if text.startswith(MYO):
        return myo_model(text)
    file = own_file(text) if text.startswith(OWN) else Path(text)
    if not file.is_file():
        if file.suffix.lower() == ".osim":
            raise ModelError(f"{file} does not exist; by its name it {opensim(file)}")
        folder, what = (file, "is a folder") if file.is_dir() else (file.parent, "does not exist")
        if not folder.is_dir():
            raise ModelError(f"model file {file} does not exist, nor does the folder {folder}")
        there = sorted(p.name for p in folder.glob("*") if p.suffix in (".xml", ".mjb"))
        own = f" (did you mean '{OWN}{file}'?)" if str(file) in own_models() else nearest(file.name, there)
        raise ModelError(f"model file {file} {what}{own}; models in {folder}: {listed(there)}")
    if not os.access(file, os.R_OK):
        raise ModelError(f"model file {file} cannot be read: permission denied")
    if kind := foreign(file):
        raise ModelError(f"{file} is not a model that MuJoCo can load: it {kind}")
    load = mujoco.MjModel.from_binary_path if is_binary(file) else mujoco.MjModel.from_xml_path
    with _collected_warnings() as found:
        try:
            model = load(os.fspath(file))
        except (ValueError, mujoco.FatalError) as error:
            reason = with_remedy(" ".join("; ".join([*found, str(error)]).split()))
            reason = with_candidates(reason, _parsed(file))
            raise ModelError(f"{file} is not a model that MuJoCo can load: {reason}") from None
    for text in found:
        warnings.warn(f"{file}: {text}", stacklevel=2)
    restore_inertias(model)
    return model


def _parsed(file: Path) -> mujoco.MjSpec | None:
    """Return the spec of a file that does not compile, None if it cannot even be parsed."""
    try:
        return None if is_binary(file) else mujoco.MjSpec.from_file(os.fspath(file))
    except (ValueError, mujoco.FatalError):
        return None


def _source(path: object) -> str:
    """Return the argument of a loader as text; `ModelError` if it is not the name of a file or model."""
    if isinstance(path, str | os.PathLike):
        text = os.fspath(path)
        if isinstance(text, str) and text.lstrip().startswith("<"):
            raise ModelError(
                "path must be the name of a file, not the text of a model: write "
                "mw.install(mujoco.MjSpec.from_string(text)), or for a MuscleSystem "
                "mujoco.MjModel.from_xml_string(text)"
            )
        if isinstance(text, str) and text:
            return text
    given = f"an {type(path).__name__}" if isinstance(path, mujoco.MjModel | mujoco.MjSpec) else repr(path)
    remedy = {
        mujoco.MjModel: "; a model that is loaded already goes to mw.MuscleSystem(model)",
        mujoco.MjSpec: "; a spec goes to mw.install(spec)",
    }.get(type(path), "")  # type: ignore[arg-type]
    raise ModelError(
        f"path must be the name of a file, or {OWN}NAME or {MYO}NAME, as str or Path, not {given}{remedy}"
    )


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
