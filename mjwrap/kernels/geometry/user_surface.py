"""Surfaces written by users: calls of functions that were compiled separately, by their addresses.

A row of kind CUSTOM holds three addresses as float64 in DIM + 1 to DIM + 3 (they are below 2**53). So the kernels are
the same for every such surface, and need not be compiled again. The C functions, all in the frame S [m]:

    void geodesic(const double start[7], double out[31])    start: P, t, s
    void project(double x, double y, double z, double out[6])    out: nearest point, outward unit normal
    double height(double x, double y, double z)    distance, to first order near the surface, negative inside

`out` of the first one: P, Q, t_P, t_Q, n_P, n_Q; kappa, tau, beta at P; the same at Q; a, a', r, r'; the smallest
kappa on the geodesic; the smallest ratio of r to the arc length on the way; 1.0 where the geodesic leaves the surface's
range of validity, else 0.0. An arc length may be negative. Where there is no surface the numbers are NaN.
`mjwrap/surfaces/codegen/` makes such functions from a user's function.
"""

from __future__ import annotations

import ctypes
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from mjwrap.kernels import layout as lay
from mjwrap.kernels.compilation.jit import config, deferred, jit
from mjwrap.kernels.geometry.vectors import put_curvature, put_end, put_fields, put_start

GEODESIC, PROJECT, HEIGHT = lay.DIM + 1, lay.DIM + 2, lay.DIM + 3  # columns of the addresses
START, GEODESIC_OUT, PROJECT_OUT = 7, 31, 6  # lengths of the arrays

_REAL, _POINTER = ir.DoubleType(), ir.DoubleType().as_pointer()
_C_REAL, _C_POINTER = ctypes.c_double, ctypes.POINTER(ctypes.c_double)
_C_GEODESIC = ctypes.CFUNCTYPE(None, _C_POINTER, _C_POINTER)
_C_PROJECT = ctypes.CFUNCTYPE(None, _C_REAL, _C_REAL, _C_REAL, _C_POINTER)
_C_HEIGHT = ctypes.CFUNCTYPE(_C_REAL, _C_REAL, _C_REAL, _C_REAL)


# ---------------------------------------------------------------------------- calls from compiled kernels


def _function(builder: Any, address: Any, returns: Any, arguments: list[Any]) -> Any:
    """Return the function of a C signature whose address is given as a double."""
    integer = builder.fptoui(address, ir.IntType(64))
    return builder.inttoptr(integer, ir.FunctionType(returns, arguments).as_pointer())


def _buffer(builder: Any, size: int) -> Any:
    """Return memory for `size` doubles on the stack."""
    return builder.bitcast(cgutils.alloca_once(builder, ir.ArrayType(_REAL, size)), _POINTER)


def _place(builder: Any, buffer: Any, i: int) -> Any:
    return builder.gep(buffer, [ir.Constant(ir.IntType(32), i)])


def _tuple(context: Any, builder: Any, buffer: Any, size: int) -> Any:
    values = [builder.load(_place(builder, buffer, i)) for i in range(size)]
    return context.make_tuple(builder, types.UniTuple(types.float64, size), values)


def _geodesic_call(typing_context: Any, address: Any, start: Any) -> Any:
    """Call a geodesic function with the seven numbers of `start`; return its 31 numbers."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        given, out = _buffer(builder, START), _buffer(builder, GEODESIC_OUT)
        for i in range(START):
            builder.store(builder.extract_value(arguments[1], i), _place(builder, given, i))
        builder.call(_function(builder, arguments[0], ir.VoidType(), [_POINTER] * 2), [given, out])
        return _tuple(context, builder, out, GEODESIC_OUT)

    returns = types.UniTuple(types.float64, GEODESIC_OUT)
    return returns(types.float64, types.UniTuple(types.float64, START)), generate


def _project_call(typing_context: Any, address: Any, x: Any, y: Any, z: Any) -> Any:
    """Call a projection with a point; return its six numbers."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        out = _buffer(builder, PROJECT_OUT)
        function = _function(builder, arguments[0], ir.VoidType(), [_REAL] * 3 + [_POINTER])
        builder.call(function, [*arguments[1:], out])
        return _tuple(context, builder, out, PROJECT_OUT)

    return types.UniTuple(types.float64, PROJECT_OUT)(*[types.float64] * 4), generate


def _height_call(typing_context: Any, address: Any, x: Any, y: Any, z: Any) -> Any:
    """Call a height function with a point; return its number."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.call(_function(builder, arguments[0], _REAL, [_REAL] * 3), arguments[1:])

    return types.float64(*[types.float64] * 4), generate


# ------------------------------------------------------------------ the same for kernels that are not compiled


def _geodesic_plain(address: float, start: tuple[float, ...]) -> tuple[float, ...]:
    out = (_C_REAL * GEODESIC_OUT)()
    _C_GEODESIC(int(address))((_C_REAL * START)(*start), out)
    return tuple(out)


def _project_plain(address: float, x: float, y: float, z: float) -> tuple[float, ...]:
    out = (_C_REAL * PROJECT_OUT)()
    _C_PROJECT(int(address))(x, y, z, out)
    return tuple(out)


def _height_plain(address: float, x: float, y: float, z: float) -> float:
    return _C_HEIGHT(int(address))(x, y, z)


_call_geodesic: Any = _geodesic_plain if config.DISABLE_JIT else intrinsic(_geodesic_call)
_call_project: Any = _project_plain if config.DISABLE_JIT else intrinsic(_project_call)
_call_height: Any = _height_plain if config.DISABLE_JIT else intrinsic(_height_call)


# ---------------------------------------------------------------------------------- what kernels call


@deferred(types.none)
def custom_geodesic(k, node):
    """Evaluate obstacle k's geodesic from its saved start (P, t, s) into its row, as `dispatch.evaluate_geodesic`.

    Column W_OUT says whether it leaves the surface's range of validity (1) or not (0).
    """
    i = lay.S_P
    start = (
        node[k, i], node[k, i + 1], node[k, i + 2], node[k, i + 3], node[k, i + 4], node[k, i + 5], node[k, i + 6],
    )  # fmt: skip
    out = _call_geodesic(node[k, GEODESIC], start)
    put_start(node, k, out[0], out[1], out[2], out[6], out[7], out[8], out[12], out[13], out[14])
    put_end(node, k, out[3], out[4], out[5], out[9], out[10], out[11], out[15], out[16], out[17])
    put_curvature(node, k, lay.W_KP, out[18], out[19], out[20])
    put_curvature(node, k, lay.W_KQ, out[21], out[22], out[23])
    put_fields(node, k, out[24], out[25], out[26], out[27], out[28], out[29])
    node[k, lay.W_OUT] = out[30]


@jit
def custom_project(k, node, x, y, z):
    """Return the nearest point of obstacle k's surface to (x, y, z), and the outward normal there; frame S."""
    return _call_project(node[k, PROJECT], x, y, z)


@jit
def custom_height(k, node, x, y, z):
    """Return how far (x, y, z) of S is from obstacle k's surface, to first order near it, negative inside [m]."""
    return _call_height(node[k, HEIGHT], x, y, z)
