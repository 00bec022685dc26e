"""Undo the changes of `install` in an MjSpec if `install` fails."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import mujoco

from mjwrap.plugin.spec.configuration import spec_instances

_CLAMP = ("forcelimited", "forcerange", "gainprm", "biasprm")


@contextmanager
def undone_on_error(spec: mujoco.MjSpec) -> Iterator[None]:
    """Undo the changes of `install` in a spec if the with block raises: force limits, widths, sleep, the instance.

    The plugin's activation stays: MuJoCo cannot undo it, and without an instance it has no effect.
    """
    actuators = [(each, [_kept(getattr(each, name)) for name in _CLAMP]) for each in spec.actuators]
    widths = [(each, each.width) for each in spec.tendons]
    bodies = [(each, each.sleep, each.plugin.active) for each in spec.bodies[1:]]
    instances = [(each, dict(each.config)) for each in spec_instances(spec)]
    try:
        yield
    except BaseException:
        for actuator, values in actuators:
            for name, value in zip(_CLAMP, values, strict=True):
                setattr(actuator, name, value)
        for tendon, width in widths:
            tendon.width = width
        for body, sleep, active in bodies:
            body.sleep = sleep
            if not active and body.plugin.active:
                body.plugin.name = body.plugin.plugin_name = ""
                body.plugin.active = False
        known = {each.name for each, _ in instances}
        for element in [p for p in spec_instances(spec) if p.name not in known]:
            spec.delete(element)
        for element, config in instances:
            element.config = config
        raise


def _kept(value: object) -> object:
    """Return a copy of a value: arrays of a spec would show later changes."""
    copy = getattr(value, "copy", None)
    return copy() if callable(copy) else value
