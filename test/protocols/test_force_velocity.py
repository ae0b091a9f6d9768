"""Force clamps and ramps of constant velocity, against closed forms."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import xb_muscle_ros as xb
from xb_muscle_ros.protocols.force_velocity_curve import _numbers_of
from xb_muscle_ros.scores.clamp import clamp_window, velocity
from xb_muscle_ros.scores.estimate import Missing
from xb_muscle_ros.scores.force_velocity import fit_hill, hill_force, hill_velocity
from xb_muscle_ros.trials.trial import Trial, TrialFacts

LOADS = np.array([0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9])


def exact_velocity(fibre: xb.Fibre, force_f0: np.ndarray, calcium_um: float) -> np.ndarray:
    """Velocity of shortening (L0/s) of the Hill-type model without series element, at a force below rest length."""
    v = fibre.values
    activation = v["act_max"] * calcium_um ** v["n"] / (v["kappa"] ** v["n"] + calcium_um ** v["n"])
    share = (force_f0 - v["Fpe0"]) / (v["Fscale"] * activation)
    lengthening = v["vmax"] * (np.sinh((share - v["e4"]) / v["e1"]) - v["e3"]) / v["e2"]
    return np.asarray(-lengthening / v["gamma"])


@pytest.fixture(scope="module")
def hill() -> xb.Fibre:
    return xb.changed(xb.load_fibre("18Dec2017a", model="hill"), {"smoothing": 0.0})


def test_a_clamped_hill_model_has_the_exact_velocities(hill: xb.Fibre) -> None:
    (found,) = xb.run_protocol("force-clamp", hill, load=LOADS.tolist(), tell=lambda line: None).results
    force = found.column("load") * found.column("isometric_f0")
    assert found.column("shortening_l0_per_s") == pytest.approx(exact_velocity(hill, force, 10.0**1.5), rel=1e-6)
    assert found.column("power_f0_l0_per_s") == pytest.approx(force * found.column("shortening_l0_per_s"), rel=1e-9)


def test_ramps_of_a_hill_model_have_the_exact_forces(hill: xb.Fibre) -> None:
    """After the middle of a shortening ramp parallel force is constant, so that force and velocity are of one curve."""
    speeds = [-0.05, -0.1, -0.2, -0.3, -0.4, 0.1]
    (found,) = xb.run_protocol("force-velocity", hill, velocity=speeds, tell=lambda line: None).results
    for speed, run in zip(speeds[:-1], found.runs, strict=False):
        inside = run.length_l0 < -0.01
        assert exact_velocity(hill, run.force_f0[inside], 10.0**1.5) == pytest.approx(-speed, rel=1e-6)
    assert found.rows[-1]["load"].value > 1.0


@pytest.mark.parametrize("model", ["hill", "hill_se", "2state", "2state_coop", "3state_coop", "4state_coop"])
def test_loads_are_held_at_a_millisecond(model: str) -> None:
    options = {"load": [0.1, 0.5, 0.9, 1.05], "rate": 1000.0, "hold": 0.1}
    (found,) = xb.run_protocol("force-clamp", "18Dec2017a", model=model, tell=lambda line: None, **options).results
    assert np.all(found.column("held_within_f0") < 1e-6)
    assert found.column("load") == pytest.approx(options["load"], abs=1e-6)
    speed = found.column("shortening_l0_per_s")
    assert np.all(np.diff(speed) < 0.0)
    assert speed[-1] < 0.0 < speed[0]


def test_vmax_is_what_the_paper_expects_of_its_fibres() -> None:
    """0.45 L0/s is about 35 % of the expected unloaded velocity (van der Zee et al. 2026): 1.3 L0/s."""
    (found,) = xb.run_protocol("force-clamp", "18Dec2017a", tell=lambda line: None).results
    vmax = found.numbers["vmax_l0_per_s"]
    assert vmax.low < 0.45 / 0.35 < vmax.high


@pytest.mark.parametrize(("a", "vmax"), [(0.25, 2.0), (0.1, 0.6), (1.0, 10.0)])
def test_hill_s_hyperbola_comes_out(a: float, vmax: float) -> None:
    found = fit_hill(LOADS, hill_velocity(LOADS, a, vmax))
    other = fit_hill(hill_force(vmax * LOADS, a, vmax), vmax * LOADS, load_is_given=False)
    for each in (found, other):
        assert not isinstance(each, Missing)
        assert each.a == pytest.approx(a, rel=1e-5)
        assert each.vmax_l0_per_s == pytest.approx(vmax, rel=1e-5)
        assert each.b_l0_per_s == pytest.approx(a * vmax, rel=1e-5)
    assert not isinstance(found, Missing)
    fine = np.linspace(0.0, 1.0, 100001)
    power = fine * hill_velocity(fine, a, vmax)
    assert found.power_l0_per_s == pytest.approx(np.max(power), rel=1e-6)
    assert found.load_at_power == pytest.approx(fine[np.argmax(power)], abs=1e-4)


def test_intervals_hold_vmax_as_often_as_they_say() -> None:
    random, inside = np.random.default_rng(4), 0
    for _ in range(300):
        found = fit_hill(LOADS, hill_velocity(LOADS, 0.25, 2.0) + 0.02 * random.normal(size=LOADS.size))
        assert not isinstance(found, Missing)
        assert found.se[2] is not None
        inside += abs(found.vmax_l0_per_s - 2.0) <= found.interval * found.se[2]
    assert 272 <= inside <= 297  # 285 expected, within 3 SD of a binomial


def test_what_is_no_hyperbola_is_missing() -> None:
    assert isinstance(fit_hill(LOADS[:3], LOADS[:3]), Missing)
    assert isinstance(fit_hill(LOADS, 1.0 + LOADS), Missing)
    assert isinstance(fit_hill(LOADS + 1.0, LOADS), Missing)


def recorded(load: float, speed: float, noise: float = 1e-3) -> Trial:
    """A fibre of 0.8 F0 that is let go to a load at 0.2 s, gives way by 1 % L0 and shortens until 0.5 s."""
    t = np.arange(0.0, 0.6, 1e-3)
    random = np.random.default_rng(7)
    on = (t >= 0.2) & (t < 0.5)
    since = np.clip(t - 0.2, 0.0, 0.3)
    length = np.where(t >= 0.2, -0.01 * (1.0 - np.exp(-since / 0.005)) - speed * since, 0.0)
    force = np.where(on, 0.8 * load, 0.8) + noise * random.normal(size=t.size)
    facts = TrialFacts("made", f"load{load:g}", pca=4.5, phases=(xb.Phase("isometric", 0.0, 0.2),))
    still = 1e-5 * random.normal(size=t.size)
    return Trial(facts, t, 1.0 + length + still, np.zeros(1), np.full(1, 31.6), t, force)


def test_a_recording_without_settings_has_its_clamp_found() -> None:
    vmax, a = 1.5, 0.3
    trials = [recorded(load, float(hill_velocity(np.array(load), a, vmax))) for load in LOADS]
    (found,) = xb.analyse_protocol("force-clamp", trials, tell=lambda line: None).results
    assert found.column("load") == pytest.approx(LOADS, abs=2e-3)
    assert found.column("shortening_l0_per_s") == pytest.approx(hill_velocity(LOADS, a, vmax), rel=5e-3, abs=2e-3)
    assert found.numbers["vmax_l0_per_s"].value == pytest.approx(vmax, rel=0.01)
    assert any("clamp, of trial load0.05, and of 9 more trials: found from force" in note for note in found.notes)
    assert all(row["shortening_l0_per_s"].se > 0.0 for row in found.rows)


def test_an_isometric_hold_after_a_clamp_is_none() -> None:
    """Regression: the ends of a longer hold differed by noise of length, and it was taken for the clamp."""
    random, loads = np.random.default_rng(0), np.array([0.05, 0.2, 0.4, 0.6, 0.8])
    time = np.arange(0.0, 0.85, 1.0 / 5000.0)
    speeds = 0.5 * (1.0 - loads) / (loads + 0.25)
    trials = []
    for load, speed in zip(loads, speeds, strict=True):
        moved = 0.02 * (1.0 - load) + speed * np.clip(time - 0.2, 0.0, 0.15)
        length = -1.0 * (time >= 0.2) * moved + 1e-4 * random.standard_normal(time.size)
        after = 0.95 - (0.95 - load) * np.exp(-8.0 * np.maximum(time - 0.35, 0.0))
        force = np.where(time < 0.2, 1.0, np.where(time < 0.35, load, after))
        force = force + 0.003 * random.standard_normal(time.size)
        trials.append(xb.make_trial("m", f"c{load:g}", time, length, 10.0**1.5, force, tell=lambda line: None))
    (found,) = xb.analyse_protocol("force-clamp", trials, tell=lambda line: None).results
    assert found.column("load") == pytest.approx(loads, abs=2e-3)
    apart = np.abs(found.column("shortening_l0_per_s") - speeds)
    assert np.all(apart < 5.0 * found.errors("shortening_l0_per_s"))
    assert np.all(found.column("read_from_s") > 0.2)
    assert np.all(found.column("read_to_s") < 0.35)


def test_a_model_repeats_a_recorded_clamp_under_its_load() -> None:
    trials = [recorded(load, 0.1) for load in (0.3, 0.5, 0.7, 0.8)]
    measured, model = xb.analyse_protocol(
        "force-clamp", trials, model="2state", fibre="18Dec2017a", tell=lambda line: None
    ).results
    assert model.column("load") == pytest.approx(measured.column("load"), abs=1e-3)
    assert np.all(np.diff(model.column("shortening_l0_per_s")) < 0.0)


def test_a_trial_without_a_clamp_is_a_note() -> None:
    made = xb.simulate("18Dec2017a", as_measured=True, recovery=0.1)
    (found,) = xb.analyse_protocol("force-clamp", made, tell=lambda line: None).results
    assert "shortening_l0_per_s" not in found.rows[0] or found.notes
    assert isinstance(velocity(np.arange(3.0), np.arange(3.0), 0.0, 2.0), Missing)
    still = np.zeros(100)
    assert isinstance(clamp_window(np.arange(100) * 1e-3, still + 1.0, still), Missing)


def test_a_load_that_no_fibre_bears_is_one_line() -> None:
    with pytest.raises(xb.UserError, match=r"trial clamp_load2500_pca45: fibre 18Dec2017a: load of"):
        xb.run_protocol("force-clamp", "18Dec2017a", load=2.5, hold=2.0, tell=lambda line: None)


def test_one_load_that_is_not_borne_leaves_the_others() -> None:
    told: list[str] = []
    loads = [0.0, 0.2, 0.3, 0.5, 0.7, 0.9]
    (found,) = xb.run_protocol("force-clamp", "18Dec2017a", load=loads, tell=told.append).results
    assert found.column("load") == pytest.approx(loads[1:], abs=1e-6)
    assert any(
        "trial clamp_load0_pca45" in line and "less than the fibre bears" in line and "is left out" in line
        for line in told
    )
    assert found.notes[0] in told
    assert np.isfinite(found.numbers["vmax_l0_per_s"].value or np.nan)


def test_a_model_repeats_a_clamp_that_a_release_began(tmp_path: Path) -> None:
    """The load is a share of the isometric force, not of what the release has left of it: that gave its square."""
    loads = [0.2, 0.3, 0.5, 0.7, 0.9]
    made = xb.run_protocol("force-clamp", "18Dec2017a", load=loads, hold=0.3, as_measured=True, tell=lambda _: None)
    untold = [replace(t, facts=replace(t.facts, settings=(), protocol="", phases=())) for t in made.trials]
    xb.write_trials(untold, tmp_path)
    measured, model = xb.analyse_protocol(
        "force-clamp", tmp_path, model="3state_coop", fibre="18Dec2017a", tell=lambda _: None
    ).results
    assert sorted(measured.column("load")) == pytest.approx(loads, abs=1e-4)
    assert model.column("load") == pytest.approx(measured.column("load"), abs=1e-5)
    assert model.column("shortening_l0_per_s") == pytest.approx(measured.column("shortening_l0_per_s"), rel=1e-4)


def test_the_power_curve_is_that_of_the_hyperbola_s_pca() -> None:
    loads = [0.1, 0.2, 0.3, 0.5, 0.7, 0.9]
    (found,) = xb.run_protocol("force-clamp", "18Dec2017a", pca=[4.5, 6.3], load=loads, tell=lambda _: None).results
    assert np.max(found.curves["power"].y) == pytest.approx(found.numbers["power_f0_l0_per_s"].value, rel=1e-3)


def test_force_that_still_changes_is_told() -> None:
    told: list[str] = []
    xb.run_protocol("force-velocity", "18Dec2017a", model="hill_se", velocity=[-0.05, -0.5], tell=told.append)
    assert any("trial velocity_minus0.5_pca45: it still changes at the middle of the ramp" in line for line in told)
    assert not any("velocity_minus0.05" in line for line in told)


def test_a_vmax_that_the_points_do_not_tell_is_said() -> None:
    load, speed = np.array([0.02, 0.3, 0.5, 0.7]), np.array([3.0, 0.3, 0.2, 0.1])
    numbers, _, told = _numbers_of(load, speed, 1.0, False)
    assert numbers["vmax_l0_per_s"].low < 0.0
    assert told[0] == "vmax: the 95 % interval goes down to 0 or below; these points do not tell it"


def test_a_velocity_is_not_read_beyond_its_load() -> None:
    with pytest.raises(
        xb.UserError, match=r"--begin 0.12 and --window 0.1 s go on beyond the load, which is held for 0.15"
    ):
        xb.run_protocol("force-clamp", "18Dec2017a", begin=0.12, window=0.1, tell=lambda line: None)


@pytest.mark.parametrize("given", [True, False])
def test_one_load_is_no_hyperbola(given: bool) -> None:
    """Four points at one load had a vmax of 0.55073 with an error of 0.00014."""
    found = fit_hill(np.array([0.2799, 0.2801, 0.2798, 0.2802]), np.array([0.3, 0.3001, 0.2999, 0.3]), given)
    assert isinstance(found, Missing)
    assert found.why.startswith("there are 1 different")


def test_a_recording_without_a_clamp_is_not_that_of_a_model() -> None:
    made = xb.simulate("18Dec2017a", as_measured=True, recovery=0.1)
    measured, model = xb.analyse_protocol(
        "force-clamp", made, model="3state_coop", fibre="18Dec2017a", tell=lambda _: None
    ).results
    if not any("load" in row for row in measured.rows):
        assert model.rows == ()
        assert any("the model has no load to bear" in note for note in model.notes)
