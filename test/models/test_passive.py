"""Passive force that is there twice is told."""

from __future__ import annotations

import pytest

import xb_muscle_ros as xb
from xb_muscle_ros.models.passive import passive_twice_line, without_own

BOTH = "3state_coop_slack+active_force_length+passive_force_length"


def test_one_line_where_the_mechanism_meets_the_sets_own_element() -> None:
    fibre = xb.load_fibre("18Dec2017a", BOTH)
    line = passive_twice_line(fibre.values)
    assert line.startswith(
        "passive force is there twice and adds up: passive_force_length (fp_max 1.3) and the set's own"
    )
    assert f"kpe {fibre.values['kpe']:.3g}" in line
    assert "\n" not in line
    for changes in (without_own(fibre.values), {"fp_max": 0.0}):
        assert passive_twice_line(xb.changed(fibre, changes).values) == ""
    assert passive_twice_line(xb.load_fibre("18Dec2017a").values) == ""


def test_simulate_and_replay_say_it() -> None:
    told: list[str] = []
    asked = {"pca": 6.1, "amplitude": 0.0, "recovery": 0.001, "settle": 0.01}
    made = xb.simulate("18Dec2017a", model=BOTH, **asked, as_measured=True, tell=told.append)
    assert sum("passive force is there twice" in line for line in told) == 1
    xb.replay(made, "18Dec2017a", model=BOTH, settle=0.01, tell=told.append)
    assert sum("passive force is there twice" in line for line in told) == 2
    told.clear()
    xb.simulate("18Dec2017a", model=BOTH, **asked, set={"kpe": 0.0, "Fpe0": 0.0}, tell=told.append)
    assert not any("passive force is there" in line for line in told)


@pytest.mark.parametrize(("model", "times"), [(BOTH, 1), ("3state_coop", 0)])
def test_loop_says_it(model: str, times: int, tmp_path: object, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("mujoco", reason="needs the extra mujoco")
    from xb_muscle_ros.cli.main import main

    asked = ["loop", "--model", model, "--model", model, "--duration", "0.02", "--out", str(tmp_path)]
    assert main(asked) == 0
    said = capsys.readouterr().err
    assert said.count("passive force is there twice") == times
    assert said.count(f"--model {model} is given 2 times; it runs once") == 1
