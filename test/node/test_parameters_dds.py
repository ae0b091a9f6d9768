"""Parameters of a running node: described, set, and refused whole."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from xb_muscle_ros.errors import UserError

FIBRE = "18Dec2017a"
F = "models.3state_coop.f"


@pytest.mark.slow
def test_descriptors_come_from_the_table(lockstep: Any) -> None:
    """Type, range, unit, and whether it can be set."""
    from rcl_interfaces.msg import ParameterType
    from rcl_interfaces.srv import DescribeParameters

    names = [F, "constants.f0_n", "rate_hz", "mode", "max_catch_up", "model"]
    request = DescribeParameters.Request(names=names)
    found = lockstep.link.call(DescribeParameters, "describe_parameters", request).descriptors
    f, f0, rate, mode, catch_up, model = found
    assert f.type == f0.type == rate.type == ParameterType.PARAMETER_DOUBLE
    assert (f.floating_point_range[0].from_value, f.floating_point_range[0].to_value) == (0.0, 1e6)
    assert "[1/s]" in f.description
    assert "[N]" in f0.description
    assert "[Hz]" in rate.description
    assert mode.read_only
    assert "lockstep" in mode.additional_constraints
    assert catch_up.integer_range[0].to_value == 1000
    assert not model.read_only


def test_a_rate_constant_set_between_ticks_acts_at_once(fresh: Any) -> None:
    """Without attachment the force decays; with it back, force returns."""
    fresh.calcium(0.0, 31.6)
    full = fresh.ask(1.0, 1.0).effort[0]
    before = fresh.link.parameters([F])[F]
    fresh.link.set_parameters({F: 0.0})
    for k in range(1, 20):
        weak = fresh.ask(1.0 + 0.1 * k, 1.0).effort[0]
    assert weak < 0.1 * full
    fresh.link.set_parameters({F: before})
    for k in range(20, 40):
        again = fresh.ask(1.0 + 0.1 * k, 1.0).effort[0]
    assert again == pytest.approx(full, rel=0.01)


def test_whole_numbers_stand_for_floating_ones(fresh: Any) -> None:
    """As they come from a command line."""
    before = fresh.link.parameters([F])[F]
    fresh.link.set_parameters({F: 80})
    assert fresh.link.parameters([F])[F] == 80.0
    fresh.link.set_parameters({F: before})


@pytest.mark.parametrize(
    ("bad", "reason"),
    [
        ({F: -1.0}, "out of range"),
        ({F: float("nan")}, "out of range"),
        ({F: "fast"}, "type"),
        (
            {"models.3state_coop.fff": 1.0},
            r"'models.3state_coop.fff' is not known; did you mean 'models.3state_coop.f'",
        ),
        ({"model": "2state"}, "when unconfigured only; clean up first"),
        ({"mode": "realtime"}, "read-only"),
        ({"rate_hz": 500.0}, "when not active only; deactivate first"),
        ({"rate_hz": float("nan")}, "out of range"),
        ({"max_catch_up": -1}, "out of range"),
        ({"models.3state_coop.smoothing": 0.0}, "when unconfigured only"),
    ],
)
def test_a_bad_set_is_refused_whole(lockstep: Any, bad: dict[str, object], reason: str) -> None:
    """The good half of it is not applied either."""
    good = "models.3state_coop.J1"
    before = lockstep.link.parameters([good])
    with pytest.raises(UserError, match=reason):
        lockstep.link.set_parameters({good: before[good] + 1.0, **bad})
    assert lockstep.link.parameters([good]) == before


@pytest.mark.slow
def test_a_running_grid_keeps_its_size(start: Callable[..., Any]) -> None:
    """A state has as many bins as it has; another rate is fine."""
    driver = start(mode="lockstep", method="characteristics")
    for name, value in (("bins", 100.0), ("strain_range", 20.0)):
        with pytest.raises(UserError, match=f"'{name}' can be set when unconfigured only"):
            driver.link.set_parameters({f"models.3state_coop.{name}": value})
    driver.link.set_parameters({F: 70.0, "models.3state_coop.bins": 200.0})
    driver.calcium(0.0, 5.0)
    assert driver.ask(1.0, 1.0) is not None


@pytest.mark.slow
def test_parameters_on_top_of_a_file(start: Callable[..., Any]) -> None:
    """The name and the set in use may differ from those of the file; what was given survives a clean-up."""
    driver = start(mode="lockstep", fibre="left_soleus", model="2state")
    driver.send("calcium", 0.0, 5.0, name=["left_soleus"])
    force = driver.ask(1.0, 1.0, name=["left_soleus"])
    assert list(force.name) == ["left_soleus"]
    assert driver.link.parameters(["model"]) == {"model": "2state"}
