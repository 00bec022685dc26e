"""numba's compiler, less what kernels do not need, which takes half the time.

Kernels have no closures, array expressions, dynamic exceptions or parallel loops. So the passes of numba's pipeline for
these are left out, and so is what numba does after every pass to check its own work. For each call of a built-in
function numba tries all its definitions in turn; here the one that matched the same types before is tried first. numba
makes millions of objects that live long, so Python's search for garbage waits.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from numba.core import errors, typed_passes, types, untyped_passes, utils
from numba.core.compiler import CompilerBase
from numba.core.compiler_machinery import PassManager
from numba.core.target_extension import get_local_target

PASSES: tuple[Any, ...] = (
    untyped_passes.TranslateByteCode,
    untyped_passes.FixupArgs,
    untyped_passes.IRProcessing,
    untyped_passes.RewriteSemanticConstants,
    untyped_passes.DeadBranchPrune,
    untyped_passes.GenericRewrites,
    untyped_passes.ReconstructSSA,
    typed_passes.NopythonTypeInference,
    typed_passes.PreLowerStripPhis,
    typed_passes.IRLegalization,
    typed_passes.AnnotateTypes,
    typed_passes.NativeLowering,
    typed_passes.NoPythonBackend,
)


class _Passes(PassManager):
    """The passes of `PASSES`, run without the checks that numba makes after each."""

    def _runPass(self, index: int, pss: Any, internal_state: Any) -> None:
        pss.analysis = self._analysis
        pss.run_initialization(internal_state)
        pss.run_pass(internal_state)
        pss.run_finalizer(internal_state)


class KernelCompiler(CompilerBase):
    """Compiles a kernel by `PASSES`."""

    def define_pipelines(self) -> list[Any]:
        """Return the pipeline."""
        passes = _Passes("kernel")
        for kind in PASSES:
            passes.add_pass(kind, kind.__name__)
        passes.finalize()
        return [passes]


# For templates of a built-in function and types of arguments: the template that matched.
_matched: dict[Any, Any] = {}
_BuiltIn: Any = types.functions.BaseFunction
_resolve: Callable[..., Any] = _BuiltIn.get_call_type
_depth = 0


@contextmanager
def faster() -> Iterator[None]:
    """Compile faster inside a with block: definitions are remembered, garbage waits. To be used under numba's lock."""
    global _depth
    collects = _depth == 0 and gc.isenabled()
    if _depth == 0:
        _BuiltIn.get_call_type = _call_type
    if collects:
        gc.disable()
    _depth += 1
    try:
        yield
    finally:
        _depth -= 1
        if _depth == 0:
            _BuiltIn.get_call_type = _resolve
        if collects:
            gc.enable()


def _call_type(function: Any, context: Any, args: Any, kws: Any) -> Any:
    """Return the signature of a call, as numba's own method does, whose place this function takes."""
    if type(function) is not types.Function or kws:
        return _resolve(function, context, args, kws)
    key = function.templates, args
    template = _matched.get(key)
    if template is not None:
        signature = _apply(template(context), function, args)
        if signature is not None:
            return signature
    signature = _resolve(function, context, args, kws)
    if signature is not None:
        _remember(key, function, context, signature)
    return signature


def _remember(key: Any, function: Any, context: Any, signature: Any) -> None:
    """Store the template that gives this signature, if it is the first that matches the types without literals."""
    order = utils.order_by_target_specificity(
        get_local_target(context), function.templates, fnkey=function.key[0]
    )
    for kind in order:
        template = kind(context)
        if template.prefer_literal:
            return
        try:
            found = _apply(template, function, key[1])
        except errors.NumbaError:
            continue
        if found is not None:
            if found == signature:
                _matched[key] = kind
            return


def _apply(template: Any, function: Any, args: Any) -> Any:
    """Return the signature by one template, or None; note its implementation as numba does."""
    signature = template.apply(tuple(map(types.unliteral, args)), {})
    if signature is not None:
        function._impl_keys[signature.args] = template.get_impl_key(signature)
    return signature
