"""Models that must be the same where a parameter takes a mechanism out."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np
import pytest

from xb_muscle_ros.models.fibre_file import Fibre, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.registry import compose

FULL = dict(load_fibre("18Dec2017a", "4state_coop").values)
TIME = np.arange(401) * 1e-3
LENGTH = np.interp(TIME, [0.0, 0.05, 0.13, 0.21, 0.4], [0.0, 0.0, 0.038, 0.0, 0.0])


def muscle(model: str, **values: float) -> Muscle:
    """A model with the four-state set's values, as far as it has use for them, and some of one's own."""
    base = load_fibre("18Dec2017a", "4state_coop")
    rows = compose(model).parameters
    given = {**FULL, "smoothing": 0.0, **values}
    full = {row.name: given.get(row.name, row.default) for row in rows}
    return Muscle(Fibre(**{**base.__dict__, "model": model, "values": MappingProxyType(full)}))


def outputs(one: Muscle, calcium: float) -> dict[str, np.ndarray]:
    """Of a stretch and shortening from isometric rest."""
    states = one.run(one.settle(0.0, calcium), np.diff(TIME), LENGTH, np.full(TIME.size, calcium))
    return one.outputs_of(states)


@pytest.mark.parametrize("smoothing", [0.0, 100.0])
@pytest.mark.parametrize("calcium", [0.4, 1.0, 31.6])
def test_four_states_without_forcible_detachment_are_three(calcium: float, smoothing: float) -> None:
    four = outputs(muscle("4state_coop", k=0.0, b=0.0, smoothing=smoothing), calcium)
    three = outputs(muscle("3state_coop", smoothing=smoothing), calcium)
    for name, values in three.items():
        np.testing.assert_allclose(four[name], values, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("jf", [0.0, 300.0])
def test_thick_filament_that_never_switches_off_is_none(jf: float) -> None:
    """With J2 = 0 every head that is not attached is ready, whatever force does to the others."""
    three = outputs(muscle("3state_coop", J1=50.0, J2=0.0, JF=jf), 0.8)
    two = outputs(muscle("2state_coop"), 0.8)
    for name in ("force_f0", "q0", "n_on", "drx"):
        np.testing.assert_allclose(three[name], two[name], atol=1e-6, err_msg=name)


def test_thin_filament_without_cooperation_or_heads_is_a_sigmoid() -> None:
    """With koop = 0 and no heads bound the sites follow kon Ca/(kon Ca + koff): n = 1, kappa = koff/kon."""
    cooperative = muscle("2state_coop", koop=0.0, f=0.0, kon=40.0, koff=80.0)
    sigmoid = muscle("2state", n=1.0, kappa=2.0, f=0.0)
    for calcium in (0.1, 1.0, 10.0):
        n_on = [m.outputs(m.settle(0.0, calcium)).n_on for m in (cooperative, sigmoid)]
        assert n_on[0] == pytest.approx(n_on[1], abs=1e-8)


HILL = {**load_fibre("18Dec2017a", "hill_se").values}


@pytest.mark.parametrize(
    ("compliant", "rigid", "values"),
    [("3state_coop", "3state_coop_rigid", {}), ("hill_se", "hill", HILL)],
    ids=["3state_coop", "hill"],
)
def test_a_stiff_series_element_is_none(compliant: str, rigid: str, values: dict[str, float]) -> None:
    series = {**values, "kse": 100.0, "kse0": 1000.0, "smoothing": 0.0}
    with_element = outputs(muscle(compliant, **series), 1.0)["force_f0"]
    without = outputs(muscle(rigid, **{**values, "smoothing": 0.0}), 1.0)["force_f0"]
    inside = np.abs(TIME[:, None] - [0.05, 0.13, 0.21]).min(axis=1) > 5e-3
    np.testing.assert_allclose(with_element[inside], without[inside], atol=1e-3)


@pytest.mark.slow
def test_softplus_with_the_resting_length_of_the_linear_spring_is_the_linear_spring() -> None:
    """Above rest the released sets' offset Fpe0 is a resting length below zero."""
    resting = -FULL["Fpe0"] / (FULL["kpe"] * FULL["gamma"])
    softplus = outputs(muscle("3state_coop_softplus", lpe0=resting, pe_sharpness=1000.0), 1.0)
    linear = outputs(muscle("3state_coop"), 1.0)
    for name in ("force_pe_f0", "force_f0"):
        np.testing.assert_allclose(softplus[name], linear[name], atol=1e-12)
