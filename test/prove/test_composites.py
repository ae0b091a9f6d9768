"""Composites: the same for the same seed, ordinary error in every one, effects of the sizes meant."""

from __future__ import annotations

import collections
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from xb_muscle_ros.cli.main import main
from xb_muscle_ros.diagnose.names import FAMILY, MEASUREMENT, MECHANISMS, Name
from xb_muscle_ros.prove.generator.artefacts import ARTEFACTS, ORDINARY, Artefacts, draw_ordinary, with_artefacts
from xb_muscle_ros.prove.generator.case import Concealed, dressed
from xb_muscle_ros.prove.generator.composite import Composite, make_composite
from xb_muscle_ros.prove.generator.composite_sizes import Sized
from xb_muscle_ros.prove.generator.effects import EFFECTS, OUTSIDE
from xb_muscle_ros.prove.generator.mix import PARTS, Spec, composites
from xb_muscle_ros.prove.generator.rest import WORTH, WORTH_SD, Rest
from xb_muscle_ros.prove.generator.study import Planned, plan
from xb_muscle_ros.prove.generator.truth import study_forces
from xb_muscle_ros.prove.generator.world import Mesh, World, isometric
from xb_muscle_ros.prove.generator.writing import key_entry
from xb_muscle_ros.prove.sealing import COMPOSITES, digest, load_benchmark

DRAG, TITIN = Name.VISCOUS_DRAG, Name.STATIC_CALCIUM_STIFFNESS
COARSE = Mesh(steps=1, dx=0.2)


@pytest.fixture(scope="module")
def pair() -> Composite:
    """A case with two mechanisms."""
    return make_composite(Spec("composite", (DRAG, TITIN), (0.008, 0.02), "3state_coop"), 7, 1)


@pytest.fixture(scope="module")
def artefact() -> Composite:
    """A case with an artefact beyond the ordinary."""
    return make_composite(Spec("artefact", (), (), "3state_coop", (Name.FORCE_DRIFT, Name.PCA_SHIFT), 8), 7, 2)


@pytest.fixture(scope="module")
def planned(worlds: dict[str, World]) -> list[Planned]:
    """A study of many trials."""
    world = worlds["3state_coop"]
    made = plan(np.random.default_rng(3), lambda pca: isometric(world, 10.0 ** (6.0 - pca)), False, 16)
    assert made is not None
    return made


@pytest.mark.slow
def test_case_follows_from_its_seed(pair: Composite) -> None:
    again = make_composite(pair.spec, 7, 1)
    assert all(np.array_equal(a, b) for a, b in zip(pair.recorded, again.recorded, strict=True))
    assert key_entry(pair, "x") == key_entry(again, "x")
    null = pair.spec._replace(kind="null", labels=(), sizes=())
    assert make_composite(null, 7, 1).values != make_composite(null, 8, 1).values


def test_effects_are_of_the_sizes_meant(pair: Composite) -> None:
    assert pair.sizes == pytest.approx(pair.spec.sizes, rel=0.6)
    entry = key_entry(pair, "x")
    assert [e["label"] for e in entry["effects"]] == [DRAG, TITIN]
    assert [e["family"] for e in entry["effects"]] == [FAMILY[Name(DRAG)], FAMILY[Name(TITIN)]]
    assert [e["unique_contribution_f0"] for e in entry["effects"]] == pair.sizes
    assert all(0.003 <= size <= 0.05 for size in pair.sizes)
    # A refit takes up a part.
    assert entry["before_refit_f0"] > max(pair.sizes)
    assert json.loads(json.dumps(entry)) == entry


def test_size_is_what_all_the_rest_cannot_take_up(pair: Composite) -> None:
    """Sizes anew, by other means: a dense least squares over columns that this test takes itself."""
    base = World(pair.spec.model, pair.values)
    shifts, gain = pair.ordinary.pca_shift, pair.ordinary.length_gain
    given = [trial.stimulus(shifts[trial.pca], gain) for trial in pair.study]

    def force(concealed: list[Concealed], values: dict[str, float], stimuli: list) -> np.ndarray:
        return np.concatenate(study_forces(dressed(concealed, base.with_values(values)), stimuli, COARSE))

    whole = force(pair.concealed, pair.values, given)
    columns = []
    for name in ("f", "k11", "k21", "k22", "kon", "koop", "JF", "kse", "kse0"):
        columns.append((force(pair.concealed, {name: 1.01 * pair.values[name]}, given) - whole) / 0.01)
    length = np.concatenate([np.maximum(s.length, 0.0) for s in given])
    columns += [0.003 * 130.0 * length, np.full(whole.size, 0.02)]
    other = [pair.concealed[0], pair.concealed[1]._replace(scale=1.01 * pair.concealed[1].scale)]
    columns.append((force(other, {}, given) - whole) / 0.01)
    samples = np.repeat(np.arange(len(given)), [s.length.size for s in given])
    for pca in shifts:
        here = np.isin(samples, [i for i, trial in enumerate(pair.study) if trial.pca == pca])
        moved = [s._replace(calcium=s.calcium * 10.0**-0.005) for s in given]
        columns.append(here * (force(pair.concealed, {}, moved) - whole) / 0.005 * 0.04)
    longer = [s._replace(length=1.005 * s.length) for s in given]
    columns += [
        (force(pair.concealed, {}, longer) - whole) / 0.005 * 0.01,
        -samples * whole * 0.003,
        np.concatenate([-0.7 * np.gradient(part) for part in np.split(whole, np.flatnonzero(np.diff(samples)) + 1)]),
        *(0.003 * (samples == i) for i in range(len(given))),
    ]
    weight = np.sqrt(WORTH * len(given) / whole.size) / WORTH_SD
    a = np.vstack([weight * np.column_stack(columns), np.eye(len(columns))])
    difference = whole - force([pair.concealed[1]], {}, given)
    taken = np.linalg.lstsq(a, np.concatenate([weight * difference, np.zeros(len(columns))]), rcond=None)[0]
    left = difference - np.column_stack(columns) @ taken
    # A true refit goes on from there: it may find more, never much less.
    linear = float(np.sqrt(np.mean(left**2)))
    assert 0.3 * linear < pair.sizes[0] < 1.15 * linear


def test_ordinary_error_is_in_every_case(pair: Composite, artefact: Composite) -> None:
    for case in (pair, artefact):
        ordinary = key_entry(case, "x")["ordinary_artefact_sizes"]
        assert set(ordinary["pca_shift"]) == {f"{trial.pca:g}" for trial in case.study}
        assert all(shift != 0.0 for shift in ordinary["pca_shift"].values())
        assert len(ordinary["force_offset"]) == len(case.study)
        assert all(ordinary[name] != 0.0 for name in ("length_gain", "run_down", "time_shift"))
        assert ordinary["force_drift"] == []
        assert ordinary["transducer_lag"] == 0.0


def test_recording_is_the_fibre_with_its_errors(pair: Composite) -> None:
    base = World(pair.spec.model, pair.values)
    given = [t.stimulus(pair.ordinary.pca_shift[t.pca], pair.ordinary.length_gain) for t in pair.study]
    for i, force in enumerate(study_forces(dressed(pair.concealed, base), given)):
        noise = pair.recorded[i] - pair.ordinary.recorded(force, i)
        assert np.std(noise) < 3.0 * pair.noise_sd[i]
        plain = pair.recorded[i] - force
        assert abs(np.mean(plain)) > 1e-5


def test_ordinary_artefacts_have_their_sizes(planned: list[Planned]) -> None:
    drawn = [draw_ordinary(np.random.default_rng(seed), planned) for seed in range(300)]
    shifts = np.array([list(artefacts.pca_shift.values()) for artefacts in drawn])
    offsets = np.array([artefacts.force_offset for artefacts in drawn])
    assert np.std(shifts) == pytest.approx(ORDINARY[Name.PCA_SHIFT], rel=0.1)
    assert np.std(offsets) == pytest.approx(ORDINARY[Name.FORCE_OFFSET], rel=0.1)
    assert np.std([artefacts.time_shift for artefacts in drawn]) == pytest.approx(7e-4, rel=0.15)
    assert np.std([artefacts.length_gain for artefacts in drawn]) == pytest.approx(0.01, rel=0.15)
    run_down = np.array([artefacts.run_down for artefacts in drawn])
    assert 0.0 <= run_down.min() < run_down.max() <= 0.003
    # Errors of trials and solutions are their own.
    assert np.all(np.abs(np.corrcoef(offsets.T) - np.eye(len(planned))) < 0.3)


@pytest.mark.parametrize("name", ARTEFACTS)
def test_artefact_is_beyond_the_ordinary(name: str, planned: list[Planned]) -> None:
    assert set(ARTEFACTS) == set(MEASUREMENT)
    ordinary = Artefacts(
        {trial.pca: 0.01 for trial in planned}, 0.001, 0.001, tuple(0.001 for _ in planned), (), 1e-4
    )  # fmt: skip
    for seed in range(20):
        artefacts = with_artefacts([name], np.random.default_rng(seed), planned, ordinary)
        beyond = {
            "pca_shift": max(map(abs, artefacts.pca_shift.values())) / 0.04,
            "run_down": artefacts.run_down / 0.003,
            "force_offset": max(map(abs, artefacts.force_offset)) / 0.003,
            "force_drift": min(map(abs, artefacts.force_drift), default=0.0) / 0.002,
            "length_gain": abs(artefacts.length_gain) / 0.01,
            "time_shift": abs(artefacts.time_shift) / 7e-4,
            "transducer_lag": artefacts.transducer_lag / 7e-4,
        }
        assert [other for other, size in beyond.items() if size >= 3.0 - 1e-9] == [name]
        assert (1.0 - artefacts.run_down) ** (len(planned) - 1) > 0.69


def test_artefacts_leave_something(artefact: Composite) -> None:
    assert artefact.artefact_residual is not None
    residual_f0, prior_residual_sd = artefact.artefact_residual
    assert residual_f0 >= 0.0015 or prior_residual_sd >= 2.5
    entry = key_entry(artefact, "x")
    assert entry["labels"] == entry["artefacts"] == ["force_drift", "pca_shift"]
    assert entry["effects"] == []
    assert entry["artefact_sizes"]["force_drift"] != entry["ordinary_artefact_sizes"]["force_drift"]
    assert entry["artefact_sizes"]["force_offset"] == entry["ordinary_artefact_sizes"]["force_offset"]


def test_rest_takes_up_what_it_has_and_no_more() -> None:
    columns = 0.02 * np.random.default_rng(1).standard_normal((4000, 3))
    taken = Rest(columns, 7).fit(columns @ [0.5, 0.0, -0.2])
    assert taken.rms < 1e-4
    assert taken.prior_residual == pytest.approx([0.5, 0.0, -0.2], abs=0.02)
    assert Rest(columns[:, 1:], 7).fit(0.5 * columns[:, 0]).rms == pytest.approx(0.01, rel=0.05)
    assert np.isnan(Rest(columns, 7).fit(np.full(4000, np.inf)).rms)


def test_refit_finds_the_least_of_a_bent_valley() -> None:
    """Compared with another program's minimum of the same cost."""
    time = np.linspace(0.0, 1.0, 700)
    errors = 0.003 * np.ones((time.size, 1))

    def model(at: np.ndarray) -> np.ndarray:
        return np.exp(at[0]) * np.exp(-time / (0.3 * np.exp(at[1]))) + errors @ at[2:]

    def slopes(at: np.ndarray) -> np.ndarray:
        return np.column_stack([(model(at + 1e-6 * unit) - model(at)) / 1e-6 for unit in np.eye(3)])

    data = 2.0 * np.exp(-time / 0.5) + 0.03 * np.sin(9.0 * time)
    weight = np.sqrt(WORTH * 7 / time.size) / WORTH_SD
    other = least_squares(lambda at: np.concatenate([weight * (data - model(at)), at]), np.zeros(3))
    found = Rest(slopes(np.zeros(3)), 7).refit(data, model, slopes, 2, 3)
    assert found.prior_residual == pytest.approx(other.x, abs=0.02)
    assert found.rms == pytest.approx(np.sqrt(np.mean((data - model(other.x)) ** 2)), rel=0.01)
    assert found.residual == pytest.approx(data - model(found.prior_residual))


def test_ordinary_error_leaves_next_to_nothing(worlds: dict[str, World], planned: list[Planned]) -> None:
    """What an ordinary error changes is taken up, and so is an offset; drift is not, for it is not ordinary."""
    study = planned[:8]
    ordinary = draw_ordinary(np.random.default_rng(1), study)
    sized = Sized(worlds["3state_coop"], study, ordinary)
    shifted = replace(ordinary, pca_shift={pca: shift + 0.03 for pca, shift in ordinary.pca_shift.items()})
    moved = replace(ordinary, force_offset=tuple(offset + 0.004 for offset in ordinary.force_offset))
    drifting = replace(ordinary, force_drift=tuple(0.02 * (-1) ** i for i in range(len(study))))
    assert sized.of_artefacts(shifted).rms < 1e-3
    assert sized.of_artefacts(moved).rms < 3e-4
    assert sized.of_artefacts(drifting).rms > 3e-3


def test_mix_has_every_kind() -> None:
    made = composites(200, 3)
    assert made == composites(200, 3)
    assert made != composites(200, 4)
    kinds = collections.Counter((spec.kind, len(spec.labels), len(spec.artefacts)) for spec in made)
    assert kinds == {
        ("null", 0, 0): 30, ("artefact", 0, 1): 16, ("artefact", 0, 2): 14, ("composite", 1, 0): 40,
        ("composite", 2, 0): 40, ("composite", 3, 0): 24, ("composite", 4, 0): 16,
        ("outside", 1, 0): 10, ("outside", 2, 0): 10,
    }  # fmt: skip
    assert sum(part.share for part in PARTS) == pytest.approx(1.0)
    for spec in made:
        mechanisms = [label for label in spec.labels if label not in OUTSIDE]
        families = [FAMILY[Name(label)] for label in mechanisms]
        assert len(families) == len(set(families))
        assert len({FAMILY[Name(label)] for label in spec.artefacts}) == len(spec.artefacts)
        assert all(spec.model in EFFECTS[label].models for label in spec.labels)
    used = collections.Counter(label for spec in made for label in spec.labels if label not in OUTSIDE)
    assert set(used) == set(MECHANISMS) - {Name.TEMPERATURE, Name.PHOSPHATE}
    assert max(used.values()) - min(used.values()) <= 2
    sizes = np.array([size for spec in made for size in spec.sizes])
    assert 0.003 <= sizes.min() < sizes.max() <= 0.05
    assert 0.65 < np.mean((sizes >= 0.01) & (sizes <= 0.04)) < 0.85
    trials = np.array([spec.trials for spec in made])
    assert trials.min() == 7
    assert 20 < trials.max() <= 30
    assert np.mean(trials <= 12) > 0.7


@pytest.mark.parametrize(("trials", "levels"), [(7, 5), (9, 5), (12, 6), (16, 7), (30, 8)])
def test_study_of_many_trials(trials: int, levels: int, worlds: dict[str, World]) -> None:
    world = worlds["3state_coop"]
    for seed in range(3):
        made = plan(np.random.default_rng(seed), lambda pca: isometric(world, 10.0 ** (6.0 - pca)), False, trials)
        assert made is not None
        assert len(made) == trials
        assert len({trial.pca for trial in made}) == levels
        assert {4.5, 9.0} <= {trial.pca for trial in made}


def test_make_composites(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    null = Spec("null", (), (), "2state")
    monkeypatch.setattr("xb_muscle_ros.prove.generator.mix.composites", lambda cases, seed: [null])
    key, out = tmp_path / "key.json", tmp_path / "b"
    command = ["prove", "make", "--kind", COMPOSITES, "--cases", "1", "--seed", "3", "--out", str(out)]
    command += ["--processes", "0", "--key", str(key)]
    assert main(command) == 0
    sealed = digest(key)
    assert sealed in capsys.readouterr().out
    public = load_benchmark(out)
    assert public["kind"] == COMPOSITES
    assert public["key_sha256"] == sealed
    content = json.loads(key.read_text())
    assert content["kind"] == COMPOSITES
    assert main(command) == 0
    assert digest(key) == sealed
    assert main([part for part in command if part not in ("--kind", COMPOSITES)]) == 2
    assert "holds another benchmark" in capsys.readouterr().err
