"""Make a compiled module from a user's functions: read, derive, check, write, load and compare them."""

from __future__ import annotations

import contextlib
import ctypes
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from mjwrap.errors import GeometryError
from mjwrap.kernels.compilation import jit
from mjwrap.surfaces.codegen import generate, implicit, library, parametric
from mjwrap.surfaces.codegen.differences import Array
from mjwrap.surfaces.codegen.source import Source

_SAME = 1e-9  # largest difference of compiled code from Python, relative to the surface's size
_COMPARED = 10  # points


class Made(NamedTuple):
    """A compiled surface: its functions `geodesic`, `project`, `height` and constants are the module's."""

    label: str  # class and name of the surface, for messages
    key: str
    module: ModuleType


def implicit_module(
    label: str, phi: Any, gradient: Any, hessian: Any, extent: tuple[float, ...], size: float | None
) -> Made:
    """Return the compiled surface phi(x, y, z) = 0; see `ImplicitSurface`."""
    with _labelled(label):
        source = Source()
        given = [("phi", phi), ("gradient", gradient), ("hessian", hessian)]
        names = [None if function is None else source.add(function, what, 3) for what, function in given]
        entry = str(names[0])
        key = library.key_of("implicit", source.text, names, extent, size)

        def make() -> str:
            core = generate.implicit_core(source, entry, names[1], names[2])
            constants = implicit.constants(core, source.function(entry), extent, size)
            return generate.module_text("implicit", core, constants)

        return Made(label, key, _loaded(key, make, label))


def parametric_module(
    label: str, r: Any, derivatives: Any, chart: parametric.Chart, size: float | None
) -> Made:
    """Return the compiled surface r(u, v); see `ParametricSurface`."""
    with _labelled(label):
        source = Source()
        entry = source.add(r, "r", 2)
        given = None if derivatives is None else source.add(derivatives, "derivatives", 2)
        key = library.key_of("parametric", source.text, entry, given, tuple(chart), size)

        def make() -> str:
            core = generate.parametric_core(source, entry, given)
            constants = parametric.constants(core, source.function(entry), chart, size)
            return generate.module_text("parametric", core, constants)

        return Made(label, key, _loaded(key, make, label))


def remade(label: str, key: str, generator: str, text: str) -> Made:
    """Return a surface from the text of its module, which another process with this version has made."""
    if generator != library.generator_hash():
        raise GeometryError(
            f"{label} was made by another version of mjwrap; make it again from its functions"
        )
    return Made(label, key, library.load(key, lambda: text, label))


@contextlib.contextmanager
def _labelled(label: str) -> Iterator[None]:
    """Add the surface's name to messages."""
    try:
        yield
    except GeometryError as error:
        raise GeometryError(f"{label}: {error}") from error.__cause__


def _loaded(key: str, make: Callable[[], str], label: str) -> ModuleType:
    """Load a module; if it has just been made, compare it with the same functions in plain Python."""
    texts: list[str] = []

    def make_and_keep() -> str:
        try:
            texts.append(make())
        except GeometryError:
            raise
        except (ArithmeticError, ValueError) as error:
            raise GeometryError(
                f"the surface or its derivatives are not finite everywhere ({error})"
            ) from error
        return texts[0]

    module = library.load(key, make_and_keep, label)
    if texts and not jit.config.DISABLE_JIT:
        _compare(module)
    return module


def _compare(module: ModuleType) -> None:
    """Raise `GeometryError` if machine code finds other points than Python, as with too large whole numbers."""
    python = generate.plain(generate.without_imports(module.TEXT))
    compiled = ctypes.CFUNCTYPE(None, *[ctypes.c_double] * 3, ctypes.POINTER(ctypes.c_double))(
        module.project.address
    )
    samples: Array = module.SAMPLES
    for sample in samples[:: max(1, len(samples) // _COMPARED), -3:]:
        out, expected = (ctypes.c_double * 6)(), [0.0] * 6
        compiled(*sample.tolist(), out)
        python.project(*sample.tolist(), expected)
        if (
            not math.dist(out[:3], expected[:3]) <= _SAME * module.SIZE
            or not math.dist(out[3:], expected[3:]) <= _SAME
        ):
            library.forget(module.__name__, Path(str(module.__file__)))
            raise GeometryError(
                f"compiled, it gives different numbers: the point nearest to {sample.tolist()} is {out[:3]}, in Python "
                f"{expected[:3]}. Compiled whole numbers have 64 bits: write 2.0 instead of 2 if they become large"
            )
