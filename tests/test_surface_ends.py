"""An end point inside a surface of any shape is named; one in its hole or beside it is not."""

from __future__ import annotations

import mujoco
import pytest
from declared_models import element
from test_mjcf_surfaces import DATA, DECLARED, numeric

import mjwrap as mw

INSIDE = {  # a point within each surface and one outside, neither of which is that of a ball of the geom's size
    "ellipsoid": ((0.0, 0.0, 0.045), (0.0, 0.025, 0.0)),
    "elliptic cylinder": ((0.025, 0.0, 0.5), (0.0, 0.025, 0.0)),
    "torus": ((0.04, 0.0, 0.005), (0.0, 0.0, 0.0)),
    "cone": ((0.026, 0.0, -0.04), (0.026, 0.0, 0.04)),
    "capsule": ((0.0, 0.0, 0.06), (0.0, 0.021, 0.0)),
}


@pytest.mark.parametrize("case", INSIDE)
def test_a_site_inside_a_surface_is_named(case: str) -> None:
    key = DECLARED[case][0]
    for place, at in zip(("inside", "outside"), INSIDE[case], strict=True):
        xml = f"""
<mujoco>
  <worldbody>
    <site name="end" pos="{" ".join(map(str, at))}"/> <site name="far" pos="0.3 0.2 0.1"/>
    <geom name="peg" size="0.001"/> <body><joint/><geom size=".01" pos="1 0 0"/></body>
  </worldbody>
  <custom>
    {numeric("mjwrap_f_optimal_force", "1")} {numeric(f"mjwrap_{key}", DATA[case])}
    <tuple name="mjwrap_rope">
      {element("site", "end")} {element("geom", "peg")} {element("numeric", f"mjwrap_{key}")} {element("site", "far")}
      {element("numeric", "mjwrap_f_optimal_force")}
    </tuple>
  </custom>
</mujoco>"""
        model = mujoco.MjModel.from_xml_string(xml)
        muscles = mw.MuscleSystem(model, strict=True)
        if place == "inside":
            with pytest.raises(mw.PathError, match="site 'end' is inside geom 'peg'"):
                muscles.forward(mujoco.MjData(model))
        else:
            muscles.forward(mujoco.MjData(model))
            assert not muscles.status.any()
