"""Derive a user's function symbolically, and write the derivatives without repeated subexpressions.

Only this module imports sympy, and only when derivatives must be derived.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from typing import Any

from mjwrap.errors import GeometryError
from mjwrap.surfaces.codegen.source import BUILTINS
from mjwrap.text import counted

Wanted = Mapping[
    str, tuple[int, str]
]  # name: (index of the returned number, arguments by which it is derived)
Lines = list[tuple[str, str]]  # (name, expression), in an order in which they can be run

_MATH = (
    "acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "cos", "cosh", "erf", "exp", "log", "sin", "sinh",
    "sqrt", "tan", "tanh",
)  # fmt: skip
_SMALL = 1024  # a number with a denominator up to this is taken as an exact fraction
_ADVICE = "write them yourself and pass them"


def derive(
    text: str, entry: str, arguments: str, count: int, groups: Sequence[Wanted], what: str
) -> list[Lines]:
    """Derive a function; return for each group of wanted names the lines that compute them.

    text: definitions as `Source` makes them; entry: the function's name there; arguments: one letter each; count: how
    many numbers it returns; what: the function's name in messages. Raises `GeometryError` if it cannot be derived.
    """
    import sympy

    symbols = dict(zip(arguments, sympy.symbols(list(arguments), real=True), strict=True))
    values = _trace(text, entry, list(symbols.values()), what)
    if len(values) != count:
        raise GeometryError(f"{what} must return {counted(count, 'number')}, not {len(values)}")
    found = []
    for wanted in groups:
        expressions = [
            _without_deltas(
                sympy.diff(values[part], *(symbols[letter] for letter in by)) if by else values[part], what
            )
            for part, by in wanted.values()
        ]
        found.append(_lines(list(wanted), expressions, what))
    return found


def _trace(text: str, entry: str, symbols: list[Any], what: str) -> list[Any]:
    """Call a function with symbols; return the resulting expressions."""
    import sympy

    kept = {"abs": abs, "pow": pow, "len": len, "range": range, "float": lambda x: x}
    refused = {name: _refusal(name, what) for name in BUILTINS if name not in kept}
    names: dict[str, Any] = {"__builtins__": {**kept, **refused}, "math": _Math(what), "exact": _exact}
    exec(compile(ast.fix_missing_locations(_Exact().visit(ast.parse(text))), "<derived>", "exec"), names)
    try:
        value = names[entry](*symbols)
        return [sympy.sympify(part) for part in (value if isinstance(value, tuple) else (value,))]
    except GeometryError:
        raise
    except Exception as error:
        reason = (
            "it contains a branch that depends on its arguments"
            if "truth value" in str(error)
            else str(error)
        )
        raise GeometryError(f"{what}: its derivatives cannot be derived ({reason}); {_ADVICE}") from error


def _refusal(name: str, what: str) -> Any:
    def refuse(*_: Any) -> Any:
        raise GeometryError(
            f"{what}: its derivatives cannot be derived ({name} is not differentiable everywhere); {_ADVICE}"
        )

    return refuse


class _Math:
    """A substitute for the module `math` when a function is called with symbols."""

    def __init__(self, what: str) -> None:
        self.what = what

    def __getattr__(self, name: str) -> Any:
        import sympy

        others = {
            "pi": sympy.pi,
            "e": sympy.E,
            "tau": 2 * sympy.pi,
            "inf": sympy.oo,
            "pow": lambda x, y: x**y,
            "fabs": abs,
            "hypot": lambda *xs: sympy.sqrt(sum(x * x for x in xs)),
            "log10": lambda x: sympy.log(x) / sympy.log(10),
            "log2": lambda x: sympy.log(x) / sympy.log(2),
            "log1p": lambda x: sympy.log(1 + x),
            "expm1": lambda x: sympy.exp(x) - 1,
            "radians": lambda x: x * sympy.pi / 180,
            "degrees": lambda x: x * 180 / sympy.pi,
        }
        if name in others:
            return others[name]
        return getattr(sympy, name) if name in _MATH else _refusal(f"math.{name}", self.what)


class _Exact(ast.NodeTransformer):
    """Mark decimal numbers, so that sympy treats whole numbers and simple fractions as exact."""

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        if not isinstance(node.value, float):
            return node
        return ast.Call(ast.Name("exact", ast.Load()), [node], [])


def _exact(value: float) -> Any:
    import sympy

    fraction: Any = sympy.Rational(value)
    return fraction if fraction.q <= _SMALL else sympy.Float(value)


def _without_deltas(expression: Any, what: str) -> Any:
    """Return a derivative without Dirac deltas that vanish, as in derivatives of abs(x)**2.5."""
    import sympy

    if not expression.has(sympy.DiracDelta):
        return expression
    kept = []
    for term in sympy.Add.make_args(sympy.expand(expression)):
        deltas = [factor for factor in sympy.Mul.make_args(term) if factor.has(sympy.DiracDelta)]
        if deltas:
            where = sympy.Dummy("where", real=True)
            rest = sympy.Mul(*[factor for factor in sympy.Mul.make_args(term) if factor not in deltas])
            if any(rest.subs(delta.args[0], where).subs(where, 0) != 0 for delta in deltas):
                raise GeometryError(
                    f"{what} has a crease at {deltas[0].args[0]} = 0 (abs without a power above 2)"
                )
        else:
            kept.append(term)
    return sympy.Add(*kept)


def _lines(names: list[str], expressions: list[Any], what: str) -> Lines:
    """Return the lines that compute named expressions, with common subexpressions computed once."""
    import sympy

    known = (
        sympy.Derivative,
        sympy.Subs,
        sympy.DiracDelta,
        sympy.Heaviside,
        sympy.Piecewise,
        sympy.zoo,
        sympy.nan,
        sympy.I,
    )
    for name, expression in zip(names, expressions, strict=True):
        if expression.has(*known) or expression.is_extended_real is False:
            raise GeometryError(f"{what}: its derivative {name} cannot be derived ({expression}); {_ADVICE}")
    shared, reduced = sympy.cse(expressions, symbols=sympy.numbered_symbols("w"))
    write = _printer().doprint
    found = [(str(symbol), write(expression)) for symbol, expression in shared]
    return found + [(name, write(expression)) for name, expression in zip(names, reduced, strict=True)]


def _printer() -> Any:
    from sympy.printing.pycode import PythonCodePrinter

    class Printer(PythonCodePrinter):
        """Write numbers with all digits, and half powers with a square root."""

        def _print_Float(self, expr: Any) -> str:
            return repr(float(expr))

        def _print_sign(self, expr: Any) -> str:
            return f"math.copysign(1.0, {self._print(expr.args[0])})"

        def _print_Pow(self, expr: Any, rational: bool = False) -> str:
            base, power = expr.as_base_exp()
            if power.is_Rational and power.q == 2:
                root = f"math.sqrt({self._print(base)})"
                return (
                    root
                    if power.p == 1
                    else f"{root}**{self._print(power.p) if power.p > 0 else f'({power.p})'}"
                )
            return super()._print_Pow(expr, rational=rational)

    return Printer()
