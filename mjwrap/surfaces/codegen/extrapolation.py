"""Generate the code of one long step along a geodesic of a given surface: Gragg's midpoint rule with extrapolation.

A step is computed eight times, with 2, 4, ..., 16 substeps. The errors contain only even powers of the substep, so that
a sum of the eight results with fixed weights has an error of order 17 (Hairer, Norsett, Wanner, Solving Ordinary
Differential Equations I, II.9). The eight columns are independent and fill the lanes of the vector unit, as with
Stoermer's rule in the kernels. Unlike that rule, the midpoint rule allows forces that depend on the velocity, as those
of a general surface do.
"""

from __future__ import annotations

import ast
import textwrap
from collections.abc import Sequence

from mjwrap.surfaces.codegen.lanes import LANES

Pairs = Sequence[tuple[str, str]]


def step_text(pairs: Pairs, field: ast.FunctionDef) -> str:
    """Return the text of `step`, which continues a geodesic and its Jacobi fields over an arc h.

    pairs: names of coordinates and their rates, such as ("x", "tx"). field: a function of all coordinates, then all
    rates, that ends by returning their second derivatives and the Gaussian curvature; its text is put into the loops.
    """
    every = [*pairs, ("a", "da"), ("r", "dr")]
    state = [name for pair in every for name in pair]
    forces = [f"force_{rate}" for _, rate in every]
    rates = dict(every) | dict(zip([rate for _, rate in every], forces, strict=True))
    body = _body(field, forces)
    n = len(state)
    even = [f"lane[{LANES * i} + i]" for i in range(n)]  # after an even number of substeps
    odd = [f"lane[{LANES * (n + i)} + i]" for i in range(n)]
    lengths = [f"length_{name}" for name, _ in pairs]
    start = [f"{even[i]} = {name}\n{odd[i]} = {name} + size * {rates[name]}" for i, name in enumerate(state)]
    doubts = [
        f"abs(combine(lane, {state.index('a')}, ERROR_WEIGHT))",
        f"abs(combine(lane, {state.index('r')}, ERROR_WEIGHT)) / (abs(r) + abs(h))",
    ]
    doubts += [
        f"abs(combine(lane, {state.index(rate)}, ERROR_WEIGHT)) * length_{name}" for name, rate in pairs
    ]
    return f'''@inner
def step({", ".join([*state, "h", *lengths])}):
    """Return an estimate of the error, and the state after an arc of h [m]; lengths: of the coordinates' units [m]."""
    lane = stack()
{_indented(body, 4)}
    for i in range(LANES):
        size = h * HALF[i]
        lane[{LANES * 2 * n} + i] = 2.0 * size
{_indented(chr(10).join(start), 8)}
    for k in range(4):
        if k > 0:
            odd(lane, 0, LANES, k)
        even(lane, 0, LANES, k)
    for k in range(4, LANES):
        odd(lane, 4, LANES, k)
        even(lane, 4, LANES, k)
    doubt = {doubts[0]}
{_indented(chr(10).join(f"doubt = max(doubt, {doubt})" for doubt in doubts[1:]), 4)}
    return doubt, {", ".join(f"combine(lane, {i}, WEIGHT)" for i in range(n))}


{_substep("even", state, rates, odd, even, body)}

{_substep("odd", state, rates, even, odd, body)}'''


def _body(field: ast.FunctionDef, forces: list[str]) -> str:
    """Return the statements that compute the second derivatives, under these names."""
    *statements, last = field.body
    assert isinstance(last, ast.Return)
    assert isinstance(last.value, ast.Tuple)
    if ast.get_docstring(field):
        statements = statements[1:]
    *bends, curvature = last.value.elts
    lines = [ast.unparse(statement) for statement in statements]
    lines += [f"{name} = {ast.unparse(bend)}" for name, bend in zip(forces, bends, strict=False)]
    return "\n".join(
        [
            *lines,
            f"bulge = -({ast.unparse(curvature)})",
            f"{forces[-2]} = bulge * a",
            f"{forces[-1]} = bulge * r",
        ]
    )


def _substep(
    name: str, state: list[str], rates: dict[str, str], source: list[str], to: list[str], body: str
) -> str:
    takes = "\n".join(f"{part} = {place}" for part, place in zip(state, source, strict=True))
    adds = "\n".join(f"{place} += size * {rates[part]}" for part, place in zip(state, to, strict=True))
    return f'''@inner
def {name}(lane, first, last, k):
    """Take the {name} substeps of round k in the columns first..last."""
    for i in range(first, last):
{_indented(takes, 8)}
{_indented(body, 8)}
        size = lane[{LANES * 2 * len(state)} + i]
        size = 0.0 if k > i else size
{_indented(adds, 8)}
'''


def _indented(text: str, spaces: int) -> str:
    return textwrap.indent(text, " " * spaces)
