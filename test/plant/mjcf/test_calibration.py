"""A calibrated fibre pulls with one F0 at full activation, and with its activation at the calcium of the table."""

from __future__ import annotations

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.plant.mjcf.calibration import FULL_PCA, POINTS, calibrated
from xb_muscle_ros.plant.mjcf.table import Choice


@pytest.mark.slow
@pytest.mark.parametrize(
    "choice",
    [Choice(), Choice("7Aug2018a"), Choice(model="3state_coop_rigid"), Choice(model="hill")],
    ids=["slack", "another fibre", "rigid", "hill"],
)
def test_isometric_force_is_the_activation(choice: Choice) -> None:
    made = calibrated(choice, "muscle")
    # On the plateau of the relations, whatever the series element takes.
    wide = {"fl_min": 0.0, "fl_max": 4.0, "fp_max": 0.0}
    values = {**made.fibre.values, **wide}
    muscle = Muscle(type(made.fibre)(**{**made.fibre.__dict__, "values": values}))
    assert made.calcium_um.shape == (POINTS,)
    assert (np.diff(made.calcium_um) >= 0.0).all()
    assert made.calcium_um[-1] == pytest.approx(10.0 ** (6.0 - FULL_PCA), rel=1e-12)
    for activation in (0.02, 0.1, 0.35, 0.6, 0.9, 0.99, 1.0):
        calcium = float(np.interp(activation, np.linspace(0.0, 1.0, POINTS), made.calcium_um))
        settled = muscle.outputs(muscle.settle(0.0, calcium))
        # Half-sarcomeres leave the optimum by what the series element is stretched.
        z = 2.0 * abs(settled.ce_length_change_l0)
        assert settled.force_f0 / (1.0 - z**2 / 2.0) == pytest.approx(activation, abs=2e-3)


def test_unknown_models_and_parameters_are_refused() -> None:
    with pytest.raises(UserError, match="model '3state_cop' is not known; did you mean '3state_coop"):
        calibrated(Choice(model="3state_cop"), "muscle soleus")
    with pytest.raises(UserError, match=r"muscle soleus: model 3state_coop_slack.* has no parameter 'J9'"):
        calibrated(Choice(parameters={"J9": 1.0}), "muscle soleus")
    with pytest.raises(UserError, match="fibre '18Dec2017x' is not known"):
        calibrated(Choice("18Dec2017x"), "muscle soleus")
