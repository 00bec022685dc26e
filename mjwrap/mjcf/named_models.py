"""Models by name: "mjwrap:NAME" for those that come with mjwrap, "myo_sim:NAME" for those of the myo-sim package."""

from __future__ import annotations

import importlib
import importlib.metadata
import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import mujoco

from mjwrap.errors import ModelError, OsimError
from mjwrap.mjcf.names import listed
from mjwrap.text import nearest

OWN, MYO = "mjwrap:", "myo_sim:"
NOISE = "Attaching a spec with an empty prefix"  # matters only when such a spec is saved
_PACKAGE = Path(__file__).resolve().parents[1]
# a wheel has the models inside the package (pyproject.toml, force-include), a clone beside it
_FOLDERS = (_PACKAGE / "models", _PACKAGE.parent / "models")


def own_models() -> dict[str, Path]:
    """Return the files of the models that come with mjwrap, by name."""
    for folder in _FOLDERS:
        found = {file.stem: file for file in sorted(folder.glob("*/*.xml"))}
        if "elbow" in found:
            return found
    return {}


def own_osim_models() -> dict[str, Path]:
    """Return the OpenSim models that come with mjwrap, by name."""
    return {file.stem: file for folder in _FOLDERS for file in sorted(folder.glob("*/*.osim"))}


def osim_file(source: str | os.PathLike[str]) -> Path:
    """Return the file of an OpenSim model that is named by its path or as "mjwrap:NAME".

    Raises `OsimError`, which lists the models, if mjwrap has none of that name.
    """
    text, known = os.fspath(source), own_osim_models()
    if not text.startswith(OWN):
        return Path(text)
    name = text.removeprefix(OWN)
    if name not in known:
        raise OsimError(
            f"mjwrap has no OpenSim model '{name}'{nearest(name, known)}; it has: {listed(known)}"
        )
    return known[name]


def own_file(source: str) -> Path:
    """Return the file of "mjwrap:NAME"; `ModelError`, which lists the models, if there is no such one."""
    name, known = source.removeprefix(OWN), own_models()
    if name in own_osim_models() and name not in known:
        raise ModelError(
            f"'{source}' is an OpenSim model; import it first: mjwrap import {source} -o {name}.xml"
        )
    if name not in known:
        raise ModelError(f"mjwrap has no model '{name}'{nearest(name, known)}; it has: {listed(known)}")
    return known[name]


def myo_spec(source: str) -> mujoco.MjSpec:
    """Return the spec of "myo_sim:NAME", with the postures that the package adds as keyframes.

    Raises `ModelError`, which names the installed versions and the models that exist, if the package is missing or
    cannot be loaded, has no such model, or cannot build it with the running MuJoCo.
    """
    name = source.removeprefix(MYO)
    try:
        package: Any = importlib.import_module("myo_sim")
    except ImportError as error:
        if isinstance(error, ModuleNotFoundError) and error.name == "myo_sim":
            raise ModelError(
                f"'{source}' needs the myo-sim package, which is not installed: pip install 'mjwrap[myo]'; models "
                f"that come with mjwrap: {listed(OWN + own for own in own_models())}"
            ) from None
        raise _broken(source, error) from None
    except Exception as error:  # a damaged or unfitting package may raise anything
        raise _broken(source, error) from None
    try:
        composed = getattr(package, "_composed_models", tuple)()
        known = sorted({*package.REGISTRY, *composed})
    except Exception as error:
        raise _broken(source, error) from None
    if name not in known:
        raise ModelError(
            f"{_versions()} has no model '{name}'{nearest(name, known)}; it has: {listed(known)}"
        )
    try:
        # 0.2.3 and older have no postures, and the oldest no build_kwargs
        postures = hasattr(package, "list_postures") and package.list_postures(name)
        with quiet_prefixes(source):
            return package.load_spec(name, **({"build_kwargs": {"postures": True}} if postures else {}))
    except Exception as error:
        raise _broken(source, error) from None


def myo_model(source: str) -> mujoco.MjModel:
    """Return the compiled model of "myo_sim:NAME"; errors as of `myo_spec`."""
    spec = myo_spec(source)
    try:
        with quiet_prefixes(source):
            return spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise _broken(source, error) from None


@contextmanager
def quiet_prefixes(source: object) -> Iterator[None]:
    """Do not show MuJoCo's warning of an empty prefix inside a with block, if the source is "myo_sim:NAME".

    It comes whenever such a spec compiles, because of how the package composes its models, and says nothing of use.
    """
    if not (isinstance(source, str) and source.startswith(MYO)):
        yield
        return
    before = mujoco.get_mju_user_warning()

    def show(text: str) -> None:
        if not text.startswith(NOISE):
            (before or warnings.warn)(text)

    mujoco.set_mju_user_warning(show)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message=NOISE)
            yield
    finally:
        mujoco.set_mju_user_warning(before)


def _broken(source: str, error: Exception) -> ModelError:
    reason = " ".join(f"{type(error).__name__}: {error}".split())
    return ModelError(
        f"'{source}' cannot be loaded by {_versions()} with MuJoCo {mujoco.__version__} ({reason}). Versions that fit: "
        "myo-sim 0.2.4 with MuJoCo 3, myo-sim 0.2.3 with MuJoCo 3 or 4; to install it again: pip install "
        "--force-reinstall --no-deps 'myo-sim==0.2.3'"
    )


def _versions() -> str:
    try:
        return f"myo-sim {importlib.metadata.version('myo-sim')}"
    except importlib.metadata.PackageNotFoundError:
        return "myo-sim (of unknown version)"
