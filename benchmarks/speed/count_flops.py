"""Count the floating-point operations of mjwrap's kernels: run them uncompiled, on numbers that count.

`counts(scene)` starts this file in a process of its own, because a process has either all kernels compiled or none.
Additions, subtractions, multiplications, divisions and square roots are one operation each, a sine or the like is one
call; what compilers fuse into one instruction counts as two. Signs, comparisons and copies count nothing.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from path_scenes import SCENES, Scene

import mjwrap as mw

Counts = dict[str, float]  # operations by name
NAMES = ("add", "mul", "div", "sqrt", "call")
MIDDLE, FEW, MORE = (
    0.4,
    4,
    8,
)  # share of the sweep at which poses are taken; how many, the fewer ones subtracted
done: Counter[str] = Counter()


class Counted(float):
    """A number that counts what is done with it."""

    def __neg__(self) -> Counted:
        return Counted(float.__neg__(self))

    def __abs__(self) -> Counted:
        return Counted(float.__abs__(self))


def _counting(name: str, function: Callable[..., float]) -> Callable[..., Counted]:
    def operation(*arguments: float) -> Counted:
        done[name] += 1
        return Counted(function(*map(float, arguments)))

    return operation


def _power(base: float, exponent: float) -> Counted:
    done["mul" if exponent == 2 else "call"] += 1
    return Counted(float(base) ** exponent)


for operator, label in (("add", "add"), ("sub", "add"), ("mul", "mul"), ("truediv", "div")):
    for prefix in ("__", "__r"):
        method = f"{prefix}{operator}__"
        setattr(Counted, method, _counting(label, getattr(float, method)))
Counted.__pow__ = _power  # type: ignore[method-assign, assignment]

CALLS = ("sin", "cos", "tan", "atan", "atan2", "asin", "acos", "exp", "log", "hypot", "tanh", "pow")
counting_math = SimpleNamespace(**vars(math))
counting_math.sqrt = _counting("sqrt", math.sqrt)
counting_math.fabs = abs
counting_math.copysign = lambda size, sign: Counted(math.copysign(size, sign))
for call in CALLS:
    setattr(counting_math, call, _counting("call", getattr(math, call)))


def counted(values: Any) -> Any:
    """Return an array of counting numbers."""
    array = np.array(values, dtype=object)
    for index in np.ndindex(array.shape):
        array[index] = Counted(array[index])
    return array


def _zeros(*shape: Any) -> Any:
    """Return an array of counting zeros, in place of `np.empty(shape)`, or of `carray(pointer, shape)`."""
    return counted(np.zeros(shape[-1]))


def _teach_kernels() -> None:
    """Let every kernel do its mathematics with counting functions, constants and arrays of its own."""
    arrays = SimpleNamespace(**vars(np))
    arrays.empty = arrays.zeros = _zeros
    shims = {"math": counting_math, "np": arrays, "carray": _zeros}
    for name, module in list(sys.modules.items()):
        if not name.startswith("mjwrap.kernels."):
            continue
        for name, value in list(vars(module).items()):
            if name in shims:
                setattr(module, name, shims[name])
            elif isinstance(value, np.ndarray) and value.dtype == np.float64:
                setattr(module, name, counted(value))
            elif isinstance(value, np.float64):  # it would not count what it is the left-hand side of
                setattr(module, name, Counted(value))


def _during(work: Callable[[], object]) -> Counter[str]:
    done.clear()
    work()
    return Counter(done)


def count_here(scene: Scene) -> dict[str, Counts]:
    """Return what a geodesic of each kind of surface takes in mid sweep, and what a whole warm pose does."""
    from mjwrap.kernels import layout
    from mjwrap.kernels.geometry import geodesics
    from mjwrap.kernels.spans import chain
    from mjwrap.paths.scene import owners

    _teach_kernels()
    first = int(MIDDLE * scene.poses)
    pos, quat = (part[first : first + MORE] for part in scene.motion())
    row = [
        mw.Obstacle(surface, pos[0, k], quat[0, k], scene.hints[k])
        for k, surface in enumerate(scene.surfaces)
    ]
    sol, owner = mw.solve_path(scene.origin, scene.insertion, row), owners(row)
    assert sol.converged, sol.status
    saved = sol._node.copy()
    pos, quat = pos[:, owner], quat[:, owner]
    found: dict[str, Counter[str]] = {}
    for k in np.flatnonzero(saved[:, layout.S_MODE] == layout.TOUCHED):
        node = counted(saved)
        kind = type(scene.surfaces[owner[k]]).__name__
        found[kind] = _during(lambda k=k, node=node: geodesics.geodesic(k, node, *node[0, :3]))
    solve_motion: Any = chain.solve_motion

    def solve(poses: int) -> None:
        ends = [counted(np.tile(point, (poses, 1))) for point in (scene.origin, scene.insertion)]
        info = np.zeros((poses, layout.INFO))
        solve_motion(*ends, counted(pos[:poses]), counted(quat[:poses]), counted(saved), True, 1e-10, info)
        assert (info[:, layout.I_STATUS] == layout.CONVERGED).all()

    more, few = _during(lambda: solve(MORE)), _during(lambda: solve(FEW))
    result = {kind: {name: float(count[name]) for name in NAMES} for kind, count in found.items()}
    result["pose"] = {name: (more[name] - few[name]) / (MORE - FEW) for name in NAMES}
    return result


def counts(scene: Scene) -> dict[str, Counts]:
    """Return `count_here` of a scene, from a process in which kernels are not compiled."""
    paths = [str(Path(mw.__file__).parents[1]), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": os.pathsep.join(paths)}
    command = [sys.executable, str(Path(__file__).resolve()), scene.name, str(scene.poses)]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if run.returncode:
        raise RuntimeError(f"counting failed:\n{run.stderr}")
    return json.loads(run.stdout)


if __name__ == "__main__":
    print(json.dumps(count_here(SCENES[sys.argv[1]](int(sys.argv[2])))))
