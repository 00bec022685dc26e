"""Insert derived derivatives into the functions that use them, and remove products with zero.

A compiler must keep 0 * x, which is NaN if x is NaN; here x is known to be finite on the surface.
"""

from __future__ import annotations

import ast

from mjwrap.surfaces.codegen.symbols import Lines


def specialise(text: str, derived: dict[str, tuple[str, Lines]]) -> str:
    """Return a module text in which calls of derived functions are replaced by the lines that compute their values.

    derived: for each function's name its arguments, one letter each, and its lines. It is only called in statements
    `names = function(arguments)`; other names in the lines are local.
    """
    tree = ast.parse(text)
    pieces = []
    for node in tree.body:
        piece = ast.get_source_segment(text, node) or ""
        if isinstance(node, ast.FunctionDef):
            if _inline(node, derived):
                _drop_zeros(node)
                piece = ast.unparse(ast.fix_missing_locations(node))
            elif node.decorator_list:
                first = node.decorator_list[0].lineno
                piece = "\n".join(text.splitlines()[first - 1 : node.end_lineno])
            piece = f"\n\n{piece}\n\n"
        pieces.append(piece)
    return "\n".join(pieces).replace("\n\n\n\n", "\n\n")


def _inline(function: ast.FunctionDef, derived: dict[str, tuple[str, Lines]]) -> bool:
    """Replace the calls of derived functions in the body of a function; return whether there were any."""
    done = False
    for block in (node.body for node in ast.walk(function) if isinstance(node, ast.FunctionDef | ast.For)):
        for place, statement in enumerate(block):
            match statement:
                case ast.Assign([ast.Tuple(targets)], ast.Call(ast.Name(name), arguments)) if name in derived:
                    letters, lines = derived[name]
                    block[place : place + 1] = _written(targets, arguments, letters, lines)
                    done = True
                    break
    return done


def _written(
    targets: list[ast.expr], arguments: list[ast.expr], letters: str, lines: Lines
) -> list[ast.stmt]:
    """Return the lines of a derived function with the caller's names."""
    outputs = [name for name, _ in lines][-len(targets) :]
    new = {letter: ast.unparse(argument) for letter, argument in zip(letters, arguments, strict=True)}
    new |= {output: ast.unparse(target) for output, target in zip(outputs, targets, strict=True)}
    used = _used([(name, text) for name, text in lines], [o for o in outputs if new[o] != "_"])
    return [
        _Rename(new).visit(statement)
        for name, text in lines
        if name in used
        for statement in ast.parse(f"{name} = {text}").body
    ]


def _used(lines: Lines, wanted: list[str]) -> set[str]:
    """Return the names that are needed to compute the wanted ones."""
    used = set(wanted)
    for name, text in reversed(lines):
        if name in used:
            used |= {node.id for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Name)}
    return used


class _Rename(ast.NodeTransformer):
    def __init__(self, new: dict[str, str]) -> None:
        self.new = new

    def visit_Name(self, node: ast.Name) -> ast.AST:
        return ast.Name(self.new.get(node.id, node.id), node.ctx)


def _drop_zeros(function: ast.FunctionDef) -> None:
    """Simplify a function by the values that are zero in it."""
    stores = [n.id for n in ast.walk(function) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
    folder = _Folder({name for name in stores if stores.count(name) == 1})
    for statement in function.body:
        folder.visit(statement)


class _Folder(ast.NodeTransformer):
    """Replace names that are zero by their value, in the order of the statements."""

    def __init__(self, once: set[str]) -> None:
        self.once = once  # names that are assigned only once
        self.zeros: set[str] = set()

    def visit_Assign(self, node: ast.Assign) -> ast.AST:
        node.value = self.visit(node.value)
        target = node.targets[0]
        if isinstance(target, ast.Name) and target.id in self.once and _is(node.value, 0.0):
            self.zeros.add(target.id)
            node.value = ast.Constant(0.0)
        return node

    def visit_Name(self, node: ast.Name) -> ast.AST:
        if isinstance(node.ctx, ast.Load) and node.id in self.zeros:
            return ast.Constant(0.0)
        return node

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.AST:
        node.operand = self.visit(node.operand)
        return ast.Constant(0.0) if isinstance(node.op, ast.USub) and _is(node.operand, 0.0) else node

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        left, right = node.left, node.right = self.visit(node.left), self.visit(node.right)
        match node.op:
            case ast.Mult() if _is(left, 0.0) or _is(right, 0.0):
                return ast.Constant(0.0)
            case ast.Add() if _is(left, 0.0):
                return right
            case ast.Add() | ast.Sub() if _is(right, 0.0):
                return left
            case ast.Sub() if _is(left, 0.0):
                return ast.UnaryOp(ast.USub(), right)
            case ast.Mult() if _is(left, 1.0):
                return right
            case ast.Mult() if _is(right, 1.0):
                return left
        return node


def _is(node: ast.AST, value: float) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) in (int, float) and node.value == value
