"""Convert a user's function to self-contained text, with its helper functions and the numbers that it uses.

Names from outside the function are looked up once, when the surface is made: numbers become literals, helper functions
are included, `math` stays. Everything else cannot become machine code and raises a `GeometryError` that names it.
"""

from __future__ import annotations

import ast
import builtins
import dis
import inspect
import linecache
import math
import numbers
import textwrap
import types
from collections.abc import Callable
from typing import Any, NoReturn

from mjwrap.errors import GeometryError

BUILTINS = ("abs", "bool", "float", "int", "len", "max", "min", "pow", "range", "round")
_ALLOWED = (
    ast.arguments, ast.arg, ast.Return, ast.Assign, ast.AnnAssign, ast.AugAssign, ast.If, ast.IfExp, ast.For, ast.While,
    ast.Break, ast.Continue, ast.Pass, ast.Expr, ast.BinOp, ast.UnaryOp, ast.BoolOp, ast.Compare, ast.Call, ast.Name,
    ast.Attribute, ast.Subscript, ast.Tuple, ast.Constant, ast.operator, ast.unaryop, ast.boolop, ast.cmpop,
    ast.expr_context,
)  # fmt: skip
_WORDS = {
    ast.List: "a list", ast.ListComp: "a list", ast.Dict: "a dictionary", ast.Set: "a set", ast.Raise: "raise",
    ast.GeneratorExp: "a generator", ast.Try: "try", ast.With: "with", ast.Assert: "assert", ast.Lambda: "a lambda",
    ast.FunctionDef: "a function inside a function", ast.Import: "import", ast.ImportFrom: "import",
    ast.JoinedStr: "a string", ast.Global: "global", ast.Nonlocal: "nonlocal", ast.Starred: "*",
    ast.NamedExpr: ":=", ast.Slice: "a slice", ast.MatMult: "@",
}  # fmt: skip
_LANGUAGE = "use only numbers, tuples, math and plain functions"


class Source:
    """The text of the functions of one surface, with each helper once."""

    def __init__(self) -> None:
        self.texts: list[str] = []  # definitions, each after the functions that it calls
        self._names: dict[types.FunctionType, str] = {}
        self._open: list[types.FunctionType] = []
        self._count = 0

    @property
    def text(self) -> str:
        """All definitions, in an order in which they can be run."""
        return "\n\n".join(self.texts)

    def function(self, name: str) -> types.FunctionType:
        """Return the user's function behind a name in the text."""
        return next(function for function, given in self._names.items() if given == name)

    def add(self, function: Any, what: str, arguments: int) -> str:
        """Add a function that is called with so many numbers; return its name in the text."""
        function = _plain(function, what)
        needed = [p for p in inspect.signature(function).parameters.values() if p.default is p.empty]
        most = function.__code__.co_argcount
        if len(needed) > arguments or most < arguments or function.__code__.co_kwonlyargcount:
            names = ", ".join(inspect.signature(function).parameters)
            raise GeometryError(
                f"{what} is called with {arguments} numbers, but {_name(function)} takes ({names})"
            )
        return self._take(function, what)

    def _take(self, function: types.FunctionType, what: str) -> str:
        if function in self._open:
            raise GeometryError(f"{what}: {_name(function)} calls itself; write it as a loop")
        if function not in self._names:
            self._open.append(function)
            node, first_line = _definition(function, what)
            name = f"user_{_name(function)}_{self._count}".replace("<lambda>", "lambda")
            self._count += 1
            made = _Rewriter(self, function, what, first_line - 1).rewrite(node, name)
            text = ast.unparse(ast.fix_missing_locations(made))
            self._open.pop()
            self._names[function] = name
            self.texts.append(text)
        return self._names[function]


def from_text(text: str, what: str) -> types.FunctionType:
    """Return the last function that a source text defines; helpers and numbers may be defined before it."""
    filename = f"<{what} {hash(text):x}>"
    linecache.cache[filename] = (len(text), None, textwrap.dedent(text).splitlines(True), filename)
    names: dict[str, Any] = {"__name__": "__surface__", "math": math}
    try:
        exec(compile(textwrap.dedent(text), filename, "exec"), names)
    except Exception as error:
        raise GeometryError(f"{what}: this source text does not run: {error}") from error
    functions = [value for value in names.values() if isinstance(value, types.FunctionType)]
    if not functions:
        raise GeometryError(f"{what}: this source text defines no function: {text!r}")
    return functions[-1]


def _plain(function: Any, what: str) -> types.FunctionType:
    """Return the Python function of a given object."""
    if isinstance(function, str):
        function = from_text(function, what)
    function = getattr(function, "py_func", function)  # compiled by numba
    if not isinstance(function, types.FunctionType):
        raise GeometryError(f"{what} must be a plain Python function, not {function!r}")
    return function


def _name(function: types.FunctionType) -> str:
    return function.__name__


def _definition(function: types.FunctionType, what: str) -> tuple[ast.FunctionDef | ast.Lambda, int]:
    """Return the syntax tree of a function, from its source file, and the number of its first line."""
    code = function.__code__
    lines = linecache.getlines(code.co_filename, function.__globals__)
    is_lambda = code.co_name == "<lambda>"
    first = 1 if is_lambda else code.co_firstlineno  # a lambda has no lines of its own: search the file
    found: list[ast.AST] = []
    if code.co_firstlineno <= len(lines):
        block = lines if is_lambda else inspect.getblock(lines[first - 1 :])
        try:
            tree = ast.parse(textwrap.dedent("".join(block)))
        except SyntaxError:
            tree = ast.Module([], [])
        kind = ast.Lambda if is_lambda else ast.FunctionDef
        found = [node for node in ast.walk(tree) if isinstance(node, kind) and _is_code_of(node, code)]
    if not found:
        raise GeometryError(
            f"{what}: the source of {_name(function)} ({code.co_filename}, line {code.co_firstlineno}) was not found, "
            "or has changed since it was loaded. Write the function in a file, or give its source as text: "
            f"'def {what}(...): ...'"
        )
    node = found[0]
    assert isinstance(node, ast.FunctionDef | ast.Lambda)
    return node, first


def _is_code_of(node: ast.AST, code: types.CodeType) -> bool:
    """Return whether a definition compiles to this byte code."""
    if isinstance(node, ast.FunctionDef):
        if node.name != code.co_name:
            return False
        # names of an outer function are in its cells: compile inside a function that has them
        node = ast.FunctionDef(**{field: getattr(node, field) for field in node._fields})
        node.decorator_list = []
        inner: ast.stmt = node
    else:
        assert isinstance(node, ast.Lambda)
        inner = ast.Expr(node)
    outer: list[ast.stmt] = [inner]
    if code.co_freevars:
        cells = [ast.Assign([ast.Name(name, ast.Store())], ast.Constant(0)) for name in code.co_freevars]
        arguments = ast.arguments([], [], None, [], [], None, [])
        outer = [ast.FunctionDef("outer", arguments, [*cells, inner], [], **_no_types())]
    module = ast.fix_missing_locations(ast.Module(outer, []))
    codes = [compile(module, "<again>", "exec")]
    while codes:
        one = codes.pop()
        if one.co_name == code.co_name and _same(one, code):
            return True
        codes += [value for value in one.co_consts if isinstance(value, types.CodeType)]
    return False


def _no_types() -> dict[str, Any]:
    return {"type_params": []} if "type_params" in ast.FunctionDef._fields else {}


def _same(one: types.CodeType, other: types.CodeType) -> bool:
    """Return whether two codes do the same; differences caused by the surrounding module are ignored."""
    return one.co_varnames == other.co_varnames and _instructions(one) == _instructions(other)


def _instructions(code: types.CodeType) -> list[tuple[str, Any]]:
    found = []
    for instruction in dis.get_instructions(code):
        name = instruction.opname.replace("LOAD_METHOD", "LOAD_ATTR")
        if name not in ("PUSH_NULL", "COPY_FREE_VARS", "NOP", "CACHE", "PRECALL"):
            jump = instruction.opcode in dis.hasjrel or instruction.opcode in dis.hasjabs
            value = instruction.argval
            if isinstance(value, types.CodeType):
                value = value.co_name
            found.append((name, None if jump else value))
    return found


class _Rewriter(ast.NodeTransformer):
    """Insert what a function uses from outside into its text, and reject what cannot be compiled."""

    def __init__(self, source: Source, function: types.FunctionType, what: str, shift: int) -> None:
        self.source, self.function, self.what, self.shift = source, function, what, shift
        self.locals = set(function.__code__.co_varnames)

    def rewrite(self, node: ast.FunctionDef | ast.Lambda, name: str) -> ast.FunctionDef:
        if node.args.vararg or node.args.kwarg or node.args.kwonlyargs:
            self.refuse(node, "*, * arguments or ** arguments")
        if "math" in self.locals:
            self.refuse(node, "a variable named math")
        body: list[ast.stmt] = node.body if isinstance(node, ast.FunctionDef) else [ast.Return(node.body)]
        if ast.get_docstring(ast.FunctionDef("f", node.args, body, [], **_no_types())):
            body = body[1:]
        plain = [ast.arg(argument.arg) for argument in [*node.args.posonlyargs, *node.args.args]]
        defaults = [self.literal(value, node, "a default") for value in self.function.__defaults__ or ()]
        arguments = ast.arguments([], plain, None, [], [], None, defaults)
        return ast.FunctionDef(name, arguments, [self.visit(line) for line in body], [], **_no_types())

    def refuse(self, node: ast.AST, thing: str, advice: str = _LANGUAGE) -> NoReturn:
        line = getattr(node, "lineno", None)
        where = (
            f"{self.function.__code__.co_filename}, line {line + self.shift}"
            if line
            else self.function.__code__.co_filename
        )
        raise GeometryError(f"{self.what} ({where}): {thing} cannot be used in a surface; {advice}")

    def generic_visit(self, node: ast.AST) -> ast.AST:
        if not isinstance(node, _ALLOWED) or isinstance(node, ast.MatMult):
            self.refuse(node, _WORDS.get(type(node), type(node).__name__))
        return super().generic_visit(node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        if node.value is None:
            return ast.Pass()
        return self.visit(ast.copy_location(ast.Assign([node.target], node.value), node))

    def visit_For(self, node: ast.For) -> ast.AST:
        if node.orelse:
            self.refuse(node, "else after a loop")
        return self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        return self.literal(node.value, node, repr(node.value))

    def visit_Expr(self, node: ast.Expr) -> ast.AST:
        if isinstance(node.value, ast.Constant):  # a docstring
            return ast.Pass()
        return self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> ast.AST:
        if node.keywords:
            self.refuse(node, "an argument given by name", "give it by position")
        arguments = [self.visit(argument) for argument in node.args]
        if not self.is_outer(node.func):
            self.refuse(node, ast.unparse(node.func))
        value, name = self.look_up(node.func), ast.unparse(node.func)
        if isinstance(value, types.BuiltinFunctionType) and value.__module__ == "math":
            function: ast.expr = ast.Attribute(ast.Name("math", ast.Load()), value.__name__, ast.Load())
        elif getattr(builtins, getattr(value, "__name__", ""), None) is value and value.__name__ in BUILTINS:
            function = ast.Name(value.__name__, ast.Load())
        elif isinstance(getattr(value, "py_func", value), types.FunctionType):
            function = ast.Name(self.source._take(_plain(value, name), self.what), ast.Load())
        else:
            short = name.rsplit(".", 1)[-1].replace("arc", "a")
            has = hasattr(math, short) and type(value).__module__.startswith("numpy")
            self.refuse(node, name, f"use math.{short}" if has else _LANGUAGE)
        return ast.copy_location(ast.Call(function, arguments, []), node)

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        if not self.is_outer(node):
            self.refuse(node, ast.unparse(node))
        return self.literal(self.look_up(node), node, ast.unparse(node))

    def visit_Name(self, node: ast.Name) -> ast.AST:
        if node.id in self.locals:
            return node
        return self.literal(self.look_up(node), node, node.id)

    def is_outer(self, node: ast.AST) -> bool:
        """Return whether a name, or the first part of a dotted name, comes from outside the function."""
        while isinstance(node, ast.Attribute):
            node = node.value
        return isinstance(node, ast.Name) and node.id not in self.locals

    def look_up(self, node: ast.expr) -> Any:
        """Return the value of a plain or dotted name outside the function."""
        if isinstance(node, ast.Attribute):
            owner = self.look_up(node.value)
            if not hasattr(owner, node.attr):
                self.refuse(node, ast.unparse(node), f"{ast.unparse(node.value)} has no {node.attr}")
            return getattr(owner, node.attr)
        assert isinstance(node, ast.Name)
        cells = inspect.getclosurevars(self.function)
        for names in (cells.nonlocals, self.function.__globals__, vars(builtins)):
            if node.id in names:
                return names[node.id]
        return self.refuse(node, node.id, "it is not defined")

    def literal(self, value: Any, node: ast.AST, name: str) -> ast.expr:
        """Return a number, or a tuple of numbers, as text."""
        if isinstance(value, tuple):
            return ast.Tuple([self.literal(item, node, name) for item in value], ast.Load())
        if hasattr(value, "dtype") and getattr(value, "shape", None) == ():
            value = value.item()
        if isinstance(value, bool):
            return ast.Constant(value)
        if isinstance(value, numbers.Integral) and abs(int(value)) < 2**53:
            return _signed(ast.Constant(abs(int(value))), int(value))
        if isinstance(value, numbers.Real):
            number = float(value)
            if math.isfinite(number):
                return _signed(ast.Constant(abs(number)), number)
            word = ast.Attribute(
                ast.Name("math", ast.Load()), "nan" if math.isnan(number) else "inf", ast.Load()
            )
            return _signed(word, number)
        advice = _LANGUAGE
        if isinstance(value, list) or hasattr(value, "dtype"):
            advice = (
                f"first write its numbers to names, as in a, b, c = {name}, or make it a tuple of numbers"
            )
        return self.refuse(node, f"{name}, which is {_article(value)},", advice)


def _signed(number: ast.expr, sign: float) -> ast.expr:
    """Return a number as an expression; a negative one as a minus, so that (-2.0)**2 gets its parentheses."""
    return ast.UnaryOp(ast.USub(), number) if sign < 0.0 else number


def _article(value: Any) -> str:
    kind = type(value).__name__
    return f"{'an' if kind[0] in 'aeiou' else 'a'} {kind}"


def call(function: Callable[..., Any], *arguments: float) -> Any:
    """Return the value of a user's function; NaN if Python raises an error that compiled code would not raise."""
    try:
        return function(*arguments)
    except (ArithmeticError, ValueError):
        return math.nan
