"""Types of arrays in named groups: what a group's fields hold, for readers and for compilers.

A group is a `NamedTuple` whose fields are annotated with these. Inside compiled code it costs nothing; at the border
between Python and compiled code each group costs about 2 us a call, so kernels that Python calls at every step take
their arrays one by one and make the groups themselves.
"""

from __future__ import annotations

from typing import Annotated, Any, get_type_hints

import numpy as np
from numba.core import types
from numpy.typing import NDArray

Floats = Annotated[NDArray[np.float64], types.float64[::1]]  # (n,)
FloatRows = Annotated[NDArray[np.float64], types.float64[:, ::1]]  # (n, columns)
Ints = Annotated[NDArray[np.int64], types.int64[::1]]
IntRows = Annotated[NDArray[np.int64], types.int64[:, ::1]]
Indices = Annotated[NDArray[np.int32], types.int32[::1]]  # MuJoCo's own
Flags = Annotated[NDArray[np.bool_], types.boolean[::1]]
Number = Annotated[float, types.float64]


def compiled_types(group: type) -> tuple[Any, ...]:
    """Return numba's types of a group's fields, in their order."""
    hints = get_type_hints(group, include_extras=True)
    return tuple(hint.__metadata__[0] for hint in hints.values())
