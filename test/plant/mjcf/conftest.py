"""Models with muscles: a forearm that is quickly built, and MyoLeg."""

from __future__ import annotations

import copy
import warnings
from collections.abc import Callable
from typing import Any

import pytest

mujoco = pytest.importorskip("mujoco")

MUSCLES = """
    <muscle name="flexor" tendon="front" {first}/>
    <muscle name="extensor" tendon="back" lengthrange="0.25 0.4" range="0.7 1.3" force="300" lmin="0.4" lmax="1.7"/>
"""
FOREARM = """
<mujoco>
  <compiler>{compiler}</compiler>
  <option timestep="0.001" integrator="{integrator}"/>
  <worldbody>
    <body><geom type="capsule" fromto="0 0 .3 0 0 0" size=".03"/>
      <site name="shoulder_front" pos=".03 0 .3"/><site name="shoulder_back" pos="-.03 0 .3"/>
      <body><joint name="elbow" axis="0 -1 0" range="0 120" limited="true" damping="0.05"/>
        <geom type="capsule" fromto="0 0 0 .25 0 0" size=".02" mass="1.5"/>
        <site name="radius" pos=".04 0 .02"/><site name="olecranon" pos="-.03 0 .01"/>
      </body>
    </body>
  </worldbody>
  <tendon>
    <spatial name="front"><site site="shoulder_front"/><site site="radius"/></spatial>
    <spatial name="back"><site site="shoulder_back"/><site site="olecranon"/></spatial>
  </tendon>
  <actuator>{before}{muscles}</actuator>
</mujoco>
"""
FIRST = 'lengthrange="0.2 0.35" range="0.6 1.4" force="500" lmin="0.5" lmax="1.6" timeconst="0.015 0.06"'


def forearm(
    first: str = FIRST, before: str = "", integrator: str = "Euler", muscles: str = MUSCLES, compiler: str = ""
) -> Any:
    """A forearm with two muscles; what the first one's actuator says can be changed."""
    text = FOREARM.format(before=before, integrator=integrator, compiler=compiler, muscles=muscles.format(first=first))
    return mujoco.MjModel.from_xml_string(text)


@pytest.fixture
def arm() -> Callable[..., Any]:
    """Makes a forearm."""
    return forearm


@pytest.fixture(scope="session")
def loaded_leg() -> Any:
    """MyoLeg, read once."""
    library = pytest.importorskip("myo_sim")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return library.load_model("myolegs")


@pytest.fixture
def leg(loaded_leg: Any) -> Any:
    """MyoLeg with a step of 1 ms, a copy for each test."""
    model = copy.copy(loaded_leg)
    model.opt.timestep = 1e-3
    return model
