"""Generate the text of a module: a user's functions and their derivatives, then one of `templates`."""

from __future__ import annotations

import ast
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from mjwrap.surfaces.codegen.extrapolation import step_text
from mjwrap.surfaces.codegen.source import Source
from mjwrap.surfaces.codegen.specialise import specialise
from mjwrap.surfaces.codegen.symbols import Lines, derive

_MARK = "generated modules begin here\n"
_FIXED = Path(__file__).parent / "templates"
_HEAD = '''"""Made by mjwrap from a user's functions; not to be edited."""

import math

import numpy as np

from mjwrap.surfaces.codegen.compiled import geodesic_entry, height_entry, inner, project_entry
from mjwrap.surfaces.codegen.lanes import ERROR_WEIGHT, HALF, LANES, WEIGHT, combine, cosine, sine, stack
'''
_GRADIENT = {"gx": "x", "gy": "y", "gz": "z"}
_HESSIAN = {"hxx": "xx", "hyy": "yy", "hzz": "zz", "hxy": "xy", "hxz": "xz", "hyz": "yz"}
_CHART = ("", "u", "v", "uu", "uv", "vv")

Derived = dict[str, tuple[str, Lines]]


class Core:
    """The functions of a surface: their text, which of them were derived, and the same functions in plain Python."""

    def __init__(self, source: Source, written: str, derived: Derived, values: dict[str, str]) -> None:
        """written: text in addition to the source's; values: the values that each derived function returns."""
        self.derived = derived
        definitions = [f"@inner\n{text}" for text in source.texts] + ([written] if written else [])
        for name, (arguments, lines) in derived.items():
            body = "".join(f"    {target} = {text}\n" for target, text in lines)
            definitions.append(
                f"@inner\ndef {name}({', '.join(arguments)}):\n{body}    return {values[name]}\n"
            )
        self.text = "\n\n".join(definitions)
        self.python = plain(self.text)


def plain(text: str) -> SimpleNamespace:
    """Run a piece of a generated module without compiling it; return its definitions."""
    names: dict[str, Any] = {
        "math": math,
        "np": np,
        "sine": math.sin,
        "cosine": math.cos,
        "inner": lambda function: function,
    }
    for entry in ("geodesic_entry", "project_entry", "height_entry"):
        names[entry] = names["inner"]
    exec(compile(text, "<surface>", "exec"), names)
    return SimpleNamespace(**{name: value for name, value in names.items() if name != "__builtins__"})


def without_imports(text: str) -> str:
    """Return the text of a module without the imports of compiled code, for `plain`."""
    return "\n".join(line for line in text.splitlines() if not line.startswith(("import ", "from ")))


def implicit_core(source: Source, phi: str, gradient: str | None, hessian: str | None) -> Core:
    """Return `value` and `second` for phi; phi, gradient, hessian: names in the source's text, None to derive."""
    second_values = ", ".join([*_GRADIENT, *_HESSIAN])
    values = {"value": "phi, gx, gy, gz", "second": second_values}
    if gradient is None:
        first = {"phi": (0, "")} | {name: (0, by) for name, by in _GRADIENT.items()}
        both = {name: (0, by) for name, by in (_GRADIENT | _HESSIAN).items()}
        value, second = derive(source.text, phi, "xyz", 1, [first, both], "phi")
        return Core(source, "", {"value": ("xyz", value), "second": ("xyz", second)}, values)
    written = f"""@inner
def value(x, y, z):
    gx, gy, gz = {gradient}(x, y, z)
    return float({phi}(x, y, z)), float(gx), float(gy), float(gz)
"""
    if hessian is None:
        place = {letter: i for i, letter in enumerate("xyz")}
        wanted = {name: (place[by], "") for name, by in _GRADIENT.items()}
        wanted |= {name: (place[by[0]], by[1]) for name, by in _HESSIAN.items()}
        (second,) = derive(source.text, gradient, "xyz", 3, [wanted], "gradient")
        return Core(source, written, {"second": ("xyz", second)}, values)
    written += f"""

@inner
def second(x, y, z):
    gx, gy, gz = {gradient}(x, y, z)
    (hxx, hxy, hxz), (_, hyy, hyz), (_, _, hzz) = {hessian}(x, y, z)
    return (
        float(gx), float(gy), float(gz), float(hxx), float(hyy), float(hzz), float(hxy), float(hxz), float(hyz)
    )
"""
    return Core(source, written, {}, values)


def parametric_core(source: Source, r: str, derivatives: str | None) -> Core:
    """Return `chart` for r; r, derivatives: names in the source's text, None to derive."""
    names = [f"{axis}{by}" for by in _CHART for axis in "xyz"]
    if derivatives is None:
        wanted = {name: ("xyz".index(name[0]), name[1:]) for name in names}
        (chart,) = derive(source.text, r, "uv", 3, [wanted], "r")
        return Core(source, "", {"chart": ("uv", chart)}, {"chart": ", ".join(names)})
    triples = [f"({', '.join(names[i : i + 3])})" for i in range(3, 18, 3)]
    written = f"""@inner
def chart(u, v):
    x, y, z = {r}(u, v)
    {", ".join(triples)} = {derivatives}(u, v)
    return {", ".join(f"float({name})" for name in names)}
"""
    return Core(source, written, {}, {})


def module_text(kind: str, core: Core, constants: dict[str, Any]) -> str:
    """Return the text of a module; kind: "implicit" or "parametric", constants: those that the template needs."""
    fixed = (_FIXED / f"{kind}.py").read_text(encoding="utf-8").split(_MARK)[1]
    fixed = specialise(fixed, core.derived)
    pairs = [("u", "du"), ("v", "dv")] if kind == "parametric" else [("x", "tx"), ("y", "ty"), ("z", "tz")]
    field = next(n for n in ast.parse(fixed).body if isinstance(n, ast.FunctionDef) and n.name == "field")
    given = "\n".join(f"{name} = {_literal(value)}" for name, value in constants.items())
    pieces = [given, core.text, step_text(pairs, field), fixed]
    text = "\n\n\n".join(piece.strip("\n") for piece in pieces)
    return f"{_HEAD}\n\n{text}\n".replace("math.sin(", "sine(").replace("math.cos(", "cosine(")


def _literal(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"np.array({value.tolist()!r})"
    return "math.inf" if value == math.inf else repr(value)
