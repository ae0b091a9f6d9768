"""Cases: the same for the same seed, of the size asked for, and telling nothing of what they conceal."""

from __future__ import annotations

import collections
from pathlib import Path

import numpy as np
import pytest

from xb_muscle_ros.cli.main import main
from xb_muscle_ros.diagnose.names import MEASUREMENT, MECHANISMS, Name
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.prove.generator.artefacts import PRIORS, Artefacts, draw_artefact
from xb_muscle_ros.prove.generator.effects import OUTSIDE
from xb_muscle_ros.prove.generator.layout import At
from xb_muscle_ros.prove.generator.mix import SIZES, Spec, singles
from xb_muscle_ros.prove.generator.noise import noise
from xb_muscle_ros.prove.generator.refit import Refit
from xb_muscle_ros.prove.generator.single import Single, make_single, size_class
from xb_muscle_ros.prove.generator.truth import Truth, study_forces
from xb_muscle_ros.prove.generator.world import Stimulus, World
from xb_muscle_ros.prove.generator.writing import key_entry, write_case
from xb_muscle_ros.prove.sealing import digest
from xb_muscle_ros.trials.bags import find_bags, read_trial


@pytest.fixture(scope="module")
def case() -> Single:
    """A case with something concealed."""
    return make_single(Spec("single", (Name.STATIC_CALCIUM_STIFFNESS,), (0.01,), "3state_coop"), 7, 1)


@pytest.mark.slow
def test_case_is_of_the_size_asked_for(case: Single) -> None:
    assert case.refitted.rms == pytest.approx(0.01, rel=0.15)
    assert case.before > case.refitted.rms
    entry = key_entry(case, "case_0001")
    assert entry["size_class_f0"] == 0.01
    assert 3e-4 <= entry["noise_rms_f0"] <= 1.4e-3
    assert len(entry["pca"]) == 7
    assert {4.5, 9.0} <= set(entry["pca"].values())


@pytest.mark.slow
def test_case_follows_from_its_seed(case: Single) -> None:
    again = make_single(case.spec, 7, 1)
    assert all(np.array_equal(a, b) for a, b in zip(case.recorded, again.recorded, strict=True))
    assert key_entry(case, "x") == key_entry(again, "x")


def test_case_tells_nothing_but_what_was_recorded(case: Single, tmp_path: Path) -> None:
    write_case(tmp_path / "case_0001", case, "fibre_0001", "gaussian")
    words = [*MECHANISMS, *MEASUREMENT] + [label.removeprefix("outside:") for label in OUTSIDE]
    words += ["single", "outside", "conceal", "effect", case.fibre, '"scale"']
    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert len(files) == 15
    for path in files:
        content = path.read_bytes().lower()
        assert [word for word in words if word.lower().encode() in content] == []
    fibre = load_fibre(tmp_path / "case_0001" / "fibre.yaml")
    assert fibre.values["smoothing"] == 0.0
    for i, bag in enumerate(find_bags([tmp_path / "case_0001" / "bags"])):
        trial = read_trial(bag)
        assert trial.facts.source == trial.facts.data_set == ""
        assert trial.facts.phases[0].name == "isometric"
        assert trial.facts.phases[0].end_s >= 0.1
        assert trial.time_s[-1] <= 2.6
        assert np.allclose(trial.measured_f0, case.recorded[i], atol=1e-12)


def test_refit_finds_other_constants(worlds: dict[str, World], study: list[Stimulus]) -> None:
    world = worlds["3state_coop"]
    other = world.with_values({"f": 1.2 * world.values["f"], "k21": 0.9 * world.values["k21"], "kpe": 0.003})
    found = Refit(world, study)(study_forces(Truth(other), study))
    assert found.rms < 5e-4


def test_refit_goes_through_a_long_valley(worlds: dict[str, World], study: list[Stimulus]) -> None:
    # Heads that let go before their stroke: everything is slower to rise and weaker, and a refit makes up for most.
    world = worlds["3state_coop"]
    data = study_forces(Truth(world).changed({At.PHOSPHATE_RATE: 40.0}), study)
    refit = Refit(world, study)
    left = refit(data)
    assert np.sqrt(np.mean((np.concatenate(data) - np.concatenate(refit.plain())) ** 2)) > 0.1
    assert left.rms < 3e-3
    assert refit(data, left).rms <= left.rms + 1e-9


def test_mix_has_every_kind_and_mechanism() -> None:
    made = singles(200, 3)
    assert made == singles(200, 3)
    assert made != singles(200, 4)
    kinds = collections.Counter(spec.kind for spec in made)
    assert kinds == {"null": 40, "artefact": 40, "single": 80, "pair": 20, "outside": 20}
    by_label = collections.Counter(spec.labels[0] for spec in made if spec.kind == "single")
    assert set(by_label) == set(MECHANISMS)
    assert max(by_label.values()) - min(by_label.values()) <= 1
    sizes = collections.Counter(spec.size for spec in made if spec.kind == "single")
    assert set(sizes) == set(SIZES)
    assert max(sizes.values()) - min(sizes.values()) <= 4
    # The first half of the numbers tells no more of the kinds than the second.
    assert {spec.kind for spec in made[:100]} == {spec.kind for spec in made[100:]}


def test_class_is_the_highest_that_is_reached() -> None:
    assert [size_class(x) for x in (0.003, 0.0044, 0.019, 0.0399, 0.2)] == [0.0, 0.005, 0.02, 0.04, 0.04]


@pytest.mark.parametrize("name", PRIORS)
def test_artefact_changes_the_recording(name: str, case: Single) -> None:
    assert set(PRIORS) == set(MEASUREMENT)
    artefacts = draw_artefact(name, np.random.default_rng(1), case.study)
    force = np.interp(np.arange(500), [0, 100, 200, 500], [0.2, 0.2, 0.5, 0.3])
    changed = artefacts.pca_shift or artefacts.length_gain or not np.array_equal(artefacts.recorded(force, 3), force)
    assert changed
    assert np.array_equal(Artefacts().recorded(force, 3), force)


def test_lag_and_delay_put_force_behind() -> None:
    ramp = np.maximum(np.arange(300) - 100.0, 0.0) * 1e-3
    for artefacts in (Artefacts(transducer_lag=0.003), Artefacts(time_shift=0.003)):
        assert ramp[-1] - artefacts.recorded(ramp, 0)[-1] == pytest.approx(0.003, abs=1e-6)


def test_noise_is_slow_and_small() -> None:
    random = np.random.default_rng(2)
    for share in (0.0, 0.5, 1.0):
        drawn, sd = noise(random, 200_000, share)
        assert 3e-4 <= sd <= 1.4e-3
        assert np.std(drawn) == pytest.approx(sd, rel=0.1)
        assert 0.9 < np.corrcoef(drawn[1:], drawn[:-1])[0, 1] < 0.985


def test_make_seals_and_keeps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    key = tmp_path / "key.json"
    command = ["prove", "make", "--cases", "1", "--seed", "8", "--out", str(tmp_path / "b"), "--processes", "0"]
    assert main([*command, "--key", str(tmp_path / "b" / "key.json")]) == 2
    assert "where the tool would find it" in capsys.readouterr().err
    assert main([*command, "--key", str(key)]) == 0
    sealed = digest(key)
    assert sealed in capsys.readouterr().out
    assert sealed in (tmp_path / "b" / "benchmark.json").read_text()
    assert not list(tmp_path.glob(".*journal"))
    assert main([*command, "--key", str(key)]) == 0
    assert digest(key) == sealed
    command[command.index("8")] = "9"
    assert main([*command, "--key", str(key)]) == 2
    assert "holds another benchmark" in capsys.readouterr().err
