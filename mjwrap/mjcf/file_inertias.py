"""Inertias that MuJoCo's compiler refuses, written into a compiled model.

OpenSim models have bodies whose principal moments no body can have: the largest exceeds the sum of the others. The
compiler refuses them, the simulation does not mind. So an imported model is compiled with the nearest moments that are
possible, and the numeric "mjwrap_inertia_BODY" has the file's, in the order of the body's principal axes. In an
attached model both names have its prefix.
"""

from __future__ import annotations

import mujoco
import numpy as np

from mjwrap import validation
from mjwrap.errors import ModelError
from mjwrap.mjcf.names import names

MARK = "mjwrap_inertia_"


def restore_inertias(model: mujoco.MjModel) -> list[str]:
    """Write into a compiled model the principal moments that an imported file has; return the names of the bodies.

    Only `model.body_inertia` changes [kg m^2]; the mass matrix is then the file's. `mw.load`, `mw.install` and the
    commands call this; call it for a model that MuJoCo has loaded, before a `MuscleSystem` runs it. It does nothing to
    a model without numerics "mjwrap_inertia_BODY", or to moments that are not three positive numbers. Raises
    `ModelError` if `model` is not an MjModel.
    """
    validation.of_type(model, "MjModel", "model", ModelError)
    bodies = {name: i for i, name in enumerate(names(model, mujoco.mjtObj.mjOBJ_BODY, model.nbody)) if name}
    done = []
    for k, name in enumerate(names(model, mujoco.mjtObj.mjOBJ_NUMERIC, model.nnumeric)):
        prefix, mark, rest = name.partition(MARK)
        body = bodies.get(prefix + rest) if mark else None
        first = int(model.numeric_adr[k])
        moments = model.numeric_data[first : first + int(model.numeric_size[k])]
        if (
            body is not None
            and moments.shape == (3,)
            and np.isfinite(moments).all()
            and (moments > 0.0).all()
        ):
            model.body_inertia[body] = moments
            done.append(prefix + rest)
    return done
