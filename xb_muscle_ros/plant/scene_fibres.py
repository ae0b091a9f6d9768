"""What a muscle node has to be started with for a scene: names of its fibres and their model."""

from __future__ import annotations

from typing import NamedTuple

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.models.registry import model_of_set

LEG = "myolegs"
_MUSCLES = {"ankle": ("soleus", "tibialis_anterior"), "knee": ("vasti",)}
SCENES = (*_MUSCLES, LEG)


class SceneFibres(NamedTuple):
    """Fibres of a scene's muscle node.

    Attributes:
        names: of the muscles, which are those of the fibres.
        model: of the fibres; constants and parameters come from the plant.
        body_model: that the plant is asked for.
    """

    names: tuple[str, ...]
    model: str
    body_model: str


def default_model(scene: str) -> str:
    """The model where none is asked for; muscles of a leg go slack."""
    return "3state_coop_slack" if scene == LEG else "3state_coop"


def scene_fibres(scene: str, model: str = "") -> SceneFibres:
    """Fibres of a scene.

    Args:
        scene: one of `SCENES`.
        model: parameter set; empty: see `default_model`.

    Raises:
        UserError: no such scene or model; for the leg: no MuJoCo, or no myo-sim.
    """
    if scene not in SCENES:
        raise UserError(f"scene '{scene}' is not known{suggest(scene, SCENES)}")
    asked = model or default_model(scene)
    model_of_set(asked, f"scene {scene}")
    if scene != LEG:
        return SceneFibres(_MUSCLES[scene], asked, asked)
    # MuJoCo and the leg's model are read for it alone.
    from xb_muscle_ros.plant.leg.body import Body
    from xb_muscle_ros.plant.mjcf.calibration import bridged_model

    return SceneFibres(Body().muscles, bridged_model(asked), asked)
