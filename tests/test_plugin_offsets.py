"""The plugin finds MuJoCo's fields where they are, and refuses a MuJoCo whose structs it cannot verify."""

from __future__ import annotations

import ctypes
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest
from mujoco.introspect import structs

from mjwrap.errors import VersionError
from mjwrap.plugin.mujoco_c import offsets as off

XML = """
<mujoco>
  <worldbody>
    <body><joint name="hinge"/><geom size="0.1"/><site name="a" pos="0.1 0 0"/></body>
    <body pos="1 0 0"><freejoint/><geom size="0.2"/><geom size="0.1" pos="0.3 0 0"/></body>
  </worldbody>
  <actuator><general joint="hinge" dyntype="filter" dynprm="0.1"/></actuator>
</mujoco>
"""


@pytest.fixture
def found() -> off.Offsets:
    return off.offsets()


def read(address: int, shape: tuple[int, ...]) -> np.ndarray[Any, Any]:
    pointer = ctypes.c_uint64.from_address(address).value
    return np.ctypeslib.as_array((ctypes.c_double * int(np.prod(shape))).from_address(pointer)).reshape(shape)


def test_fields_of_another_model_are_read_and_written_there(found: off.Offsets) -> None:
    model = mujoco.MjModel.from_xml_string(XML)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(3)
    data.qpos[:1], data.qvel[:], data.ctrl[:], data.time = 0.3, rng.normal(size=model.nv), 0.7, 1.5
    mujoco.mj_step(model, data, nstep=3)
    for name in (
        "qpos",
        "qvel",
        "act",
        "ctrl",
        "xipos",
        "site_xpos",
        "geom_xmat",
        "cvel",
        "subtree_com",
        "act_dot",
    ):
        shown = getattr(data, name)
        assert shown.any()
        np.testing.assert_array_equal(read(data._address + found.data[name], shown.shape), shown)
    assert ctypes.c_double.from_address(data._address + found.data["time"]).value == data.time
    read(data._address + found.data["xfrc_applied"], (model.nbody, 6))[1, 4] = 2.5
    assert data.xfrc_applied[1, 4] == 2.5


def test_options_are_read_where_they_are_set(found: off.Offsets) -> None:
    model = mujoco.MjModel.from_xml_string(XML)
    for name, value, kind in (
        ("timestep", 0.0123, ctypes.c_double),
        ("integrator", 3, ctypes.c_int),
        ("disableflags", 2048, ctypes.c_int),
        ("disableactuator", 5, ctypes.c_int),
    ):
        setattr(model.opt, name, value)
        assert kind.from_address(model._address + found.model[f"opt.{name}"]).value == value


def without(struct: str, field: str) -> Any:
    """The declarations of all structs, but for one field of one of them."""
    declared: Any = structs.STRUCTS
    fields = tuple(f for f in declared[struct].fields if f.name != field)
    return dict(declared) | {struct: SimpleNamespace(fields=fields)}


@pytest.mark.parametrize(
    ("struct", "field"), [("mjData", "arena"), ("mjModel", "nq"), ("mjOption", "impratio")]
)
def test_fields_that_are_not_where_they_are_declared_are_refused(
    monkeypatch: pytest.MonkeyPatch, struct: str, field: str
) -> None:
    """Without one of its fields a struct shifts all that follow it, as an unknown version would."""
    declared = without(struct, field)
    monkeypatch.setattr(off, "structs", lambda: declared)
    with pytest.raises(VersionError, match=r"MuJoCo .* is not where its declaration puts it"):
        off.offsets.__wrapped__()


def test_a_missing_field_and_an_unknown_type_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    declared = without("mjData", "subtree_com")
    monkeypatch.setattr(off, "structs", lambda: declared)
    with pytest.raises(VersionError, match="have no subtree_com"):
        off.offsets.__wrapped__()
    monkeypatch.delitem(off._TYPES, "mjtNum")
    with pytest.raises(VersionError, match="type mjtNum"):
        off.offsets.__wrapped__()
