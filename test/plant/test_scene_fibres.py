"""What the launch file starts a muscle node with is what the scene's body asks of it."""

from __future__ import annotations

import pytest

from xb_muscle_ros.errors import UserError

pytest.importorskip("mujoco", reason="needs the extra mujoco")

from xb_muscle_ros.plant.scene_fibres import LEG, SCENES, default_model, scene_fibres


@pytest.mark.parametrize("scene", [scene for scene in SCENES if scene != LEG])
def test_fibres_of_one_joint_are_the_plants_muscles(scene: str) -> None:
    from xb_muscle_ros.plant.plant import SCENES as PLANTS
    from xb_muscle_ros.plant.plant import Plant

    assert scene in PLANTS
    found = scene_fibres(scene)
    assert list(found.names) == [muscle.name for muscle in Plant(scene).muscles]
    assert found.model == found.body_model == default_model(scene)
    assert scene_fibres(scene, "hill").model == "hill"


@pytest.mark.parametrize("model", ["", "hill_se_slack", "hill+passive_force_length"])
def test_fibres_of_the_leg_are_those_of_its_muscles(model: str) -> None:
    pytest.importorskip("myo_sim", reason="needs the extra body")
    from xb_muscle_ros.models.fibre_file import load_fibre
    from xb_muscle_ros.plant.leg.body import Body
    from xb_muscle_ros.plant.leg.drives import bridged

    found = scene_fibres(LEG, model)
    muscles = bridged(Body(), load_fibre("18Dec2017a", found.body_model), "18Dec2017a", elastic=False)
    assert list(found.names) == [fibre.name for fibre in muscles.fibres]
    assert {found.model} == {fibre.model for fibre in muscles.fibres}


def test_what_is_not_known_is_named() -> None:
    with pytest.raises(UserError, match=r"scene 'myoleg' is not known; did you mean 'myolegs'\?"):
        scene_fibres("myoleg")
    with pytest.raises(UserError, match="model '3state_cop' is not known"):
        scene_fibres(LEG, "3state_cop")
