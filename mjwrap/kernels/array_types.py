"""Types of the arrays in named groups, for type checkers and for numba.

A group is a `NamedTuple` whose fields are annotated with these types. Inside compiled code a group costs nothing. In a
call from Python each group costs about 2 us, so kernels that Python calls at every step take the arrays one by one and
make the groups themselves (`coupling/from_python.py`).
"""

from __future__ import annotations

from typing import Annotated, Any, get_type_hints

import numpy as np
from numba.core import types
from numpy.typing import NDArray

Floats = Annotated[NDArray[np.float64], types.float64[::1]]  # (n,)
FloatRows = Annotated[NDArray[np.float64], types.float64[:, ::1]]  # (n, columns)
FloatStacks = Annotated[NDArray[np.float64], types.float64[:, :, ::1]]  # (n, rows, columns)
Ints = Annotated[NDArray[np.int64], types.int64[::1]]
IntRows = Annotated[NDArray[np.int64], types.int64[:, ::1]]
Indices = Annotated[NDArray[np.int32], types.int32[::1]]  # MuJoCo's own
Flags = Annotated[NDArray[np.bool_], types.boolean[::1]]
Number = Annotated[float, types.float64]


def compiled_types(group: type) -> tuple[Any, ...]:
    """Return the numba types of a group's fields, in order."""
    hints = get_type_hints(group, include_extras=True)
    return tuple(hint.__metadata__[0] for hint in hints.values())
