"""Whole diagnoses of small made studies: what is concealed is found, and garbage never gets a name."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.cli.main import main
from xb_muscle_ros.diagnose.names import MECHANISMS, Name, Verdict
from xb_muscle_ros.diagnose.run import diagnose_bags
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre, changed, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.replay.made import made
from xb_muscle_ros.trials.bag_writing import write_trial
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.trial import Trial

FIBRE = "18Dec2017a"
PHYSICS = {n.value for n in MECHANISMS}


def truth(model: str = "3state_coop", **values: float) -> Fibre:
    """A fibre that differs from the file's in its parameters, and by what is concealed.

    Its heads are distributed as they are, not as the Gaussian form has it: a diagnosis takes that form's error out.
    """
    given = changed(load_fibre(FIBRE, model, "characteristics"), {"smoothing": 0.0, **values}, "test")
    scaled = {name: given.values[name] * factor for name, factor in (("f", 1.2), ("k21", 0.85), ("kse", 1.15))}
    return replace(given, values=MappingProxyType({**given.values, **scaled}))


PROTOCOL = StretchShortenStretch(0.0383, 0.1, lead_s=0.15, hold_s=0.15)


def study(
    fibre: Fibre,
    pcas: tuple[float, ...] = (4.5, 6.0, 6.2, 9.0),
    protocol: StretchShortenStretch = PROTOCOL,
    **faults: float,
) -> list[Trial]:
    random, muscle = np.random.default_rng(3), Muscle(fibre)
    return [made(muscle, protocol.trial(FIBRE, pca), random, 7e-4, **faults) for pca in pcas]


def write(folder: Path, trials: list[Trial]) -> Path:
    for trial in trials:
        write_trial(folder / trial.facts.trial, trial)
    return folder


@pytest.fixture(scope="module")
def drag(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("drag")
    bags = write(folder / "bags", study(truth("3state_coop+viscous_drag", drag=0.04)))
    return folder, diagnose_bags([bags], FIBRE, folder / "out", quick=True)


def test_concealed_drag_is_found_and_modelled(drag: tuple[Path, dict[str, Any]]) -> None:
    folder, found = drag
    assert found["verdict"] == "physics"
    assert found["answer"][0] == "viscous_drag"
    assert found["p_value"] < 0.01
    assert found["after"]["heldout_rmsd_f0"] < 0.5 * found["before"]["heldout_rmsd_f0"]
    row = next(c for c in found["candidates"] if c["name"] == "viscous_drag")
    assert row["parameters"]["drag"] == pytest.approx(0.04, rel=0.1)
    low, high = row["interval"]["drag"]
    assert low < 0.04 < high
    assert json.loads((folder / "out" / "diagnosis.json").read_text()) == found


def test_the_json_has_what_users_build_on(drag: tuple[Path, dict[str, Any]]) -> None:
    _, found = drag
    wanted = {
        "verdict", "answer", "family", "p_value", "confidence", "mismatch", "conflicts", "kernel", "candidates",
        "before", "after", "flexible_bound_rmsd_f0", "linear_heldout", "next_experiment", "augmented_fiber",
        "summary", "how",
    }  # fmt: skip
    assert wanted <= set(found)
    assert {"trial", "phase", "start_s", "end_s", "size_f0", "sign", "p_value"} <= set(found["mismatch"][0])
    row = found["candidates"][0]
    assert {"name", "kind", "parameters", "interval", "train_rmsd_f0", "heldout_rmsd_f0", "delta_elpd", "se"} <= set(
        row
    )
    assert {"noise_sd_f0", "noise_from", "noise_samples"} <= set(found["trials"][0])
    assert found["trials"][0]["noise_from"] == "window"
    # One trial of each solution.
    assert [(row["between"], row["parts"]) for row in found["conflicts"]] == [("trials", 4)]
    assert Verdict(found["verdict"])
    assert all(Name(n) for n in found["answer"])


def test_the_augmented_fibre_steps_and_says_where_it_comes_from(drag: tuple[Path, dict[str, Any]]) -> None:
    folder, found = drag
    fibre = load_fibre(folder / "out" / found["augmented_fiber"])
    assert fibre.model == "3state_coop+viscous_drag"
    assert "viscous_drag" in fibre.source
    muscle = Muscle(fibre)
    state = muscle.settle(0.0, 1.0, 1.0)
    moving = muscle.outputs(muscle.step(state, 1e-3, 1.0, 1e-3)).force_pe_f0
    resting = muscle.outputs(muscle.step(state, 0.0, 1.0, 1e-3)).force_pe_f0
    assert moving - resting == pytest.approx(fibre.values["drag"] * 1.0, rel=0.05)


def test_report_and_next_experiment_are_there(drag: tuple[Path, dict[str, Any]]) -> None:
    from xb_muscle_ros.trials.bags import read_trial

    folder, found = drag
    page = (folder / "out" / "report.html").read_text(encoding="utf-8")
    assert "viscous drag" in page
    proposed = read_trial(folder / "out" / found["next_experiment"]["bag"])
    assert proposed.time_s.size > 100
    assert not proposed.force_n.size


def test_a_second_run_takes_what_the_first_one_kept(drag: tuple[Path, dict[str, Any]]) -> None:
    folder, found = drag
    again = diagnose_bags([folder / "bags"], FIBRE, folder / "out", quick=True, report=False)
    assert {**again, "seconds": 0.0} == {**found, "seconds": 0.0}


def test_drag_is_found_where_nothing_holds_still_for_long(tmp_path: Path) -> None:
    """Pauses of 10 and 40 ms: noise is taken from what smooth curves leave, and the user is told."""
    protocol = StretchShortenStretch(0.0383, 0.01, lead_s=0.01, hold_s=0.04)
    trials = study(truth("3state_coop+viscous_drag", drag=0.04), (4.5, 6.2, 9.0), protocol)
    found = diagnose_bags([write(tmp_path / "bags", trials)], FIBRE, tmp_path / "out", quick=True, report=False)
    assert found["answer"][:1] == ["viscous_drag"]
    assert [row["noise_from"] for row in found["trials"]] == ["curve"] * 3
    assert all(row["noise_samples"] >= 20 and 3e-4 < row["noise_sd_f0"] < 2e-3 for row in found["trials"])
    assert any("60 evenly spaced samples of force or more while nothing moves" in line for line in found["missing"])
    assert ", by what smooth curves leave of force. " in found["summary"]


def test_other_parameters_are_no_physics(tmp_path: Path) -> None:
    found = diagnose_bags([write(tmp_path / "bags", study(truth()))], FIBRE, tmp_path / "out", True, report=False)
    assert found["verdict"] in ("none", "parameters")
    assert found["answer"] == []
    assert found["augmented_fiber"] is None


def noise_free(model: str = "3state_coop", **values: float) -> list[Trial]:
    """A study that the Gaussian form made, without noise: what differs is the parameters and what is concealed."""
    fibre = truth(model, **values)
    given = changed(load_fibre(FIBRE, model), {"smoothing": 0.0}, "test")
    muscle = Muscle(replace(given, values=MappingProxyType({n: fibre.values[n] for n in given.values})))
    random = np.random.default_rng(3)
    return [made(muscle, PROTOCOL.trial(FIBRE, pca), random, 0.0) for pca in (4.5, 6.0, 6.2, 9.0)]


def test_a_noise_free_study_of_the_model_itself_misses_nothing(tmp_path: Path) -> None:
    """The Gaussian form made it: its error, which such recordings do not have, is not taken out of the model."""
    found = diagnose_bags([write(tmp_path / "bags", noise_free())], FIBRE, tmp_path / "out", True, report=False)
    assert found["verdict"] == "parameters"
    assert found["answer"] == found["mismatch"] == []
    assert found["confidence"] is None
    assert found["before"]["train_rmsd_f0"] < 1e-3
    assert not any("Gaussian form" in line for line in found["notes"])
    assert "unlikely" not in found["summary"]
    assert all(f"Note: {line}." in found["summary"] for line in found["notes"])


def test_a_noise_free_study_names_what_was_put_in_and_nothing_else(tmp_path: Path) -> None:
    trials = noise_free("3state_coop+viscous_drag", drag=0.04)
    found = diagnose_bags([write(tmp_path / "bags", trials)], FIBRE, tmp_path / "out", True, report=False)
    assert found["verdict"] == "physics"
    assert found["answer"] == ["viscous_drag"]
    assert found["heldout_gain"]["better"]
    assert found["after"]["heldout_rmsd_f0"] < 0.2 * found["before"]["heldout_rmsd_f0"]


def random_force(trials: list[Trial]) -> list[Trial]:
    random = np.random.default_rng(0)
    return [replace(t, force_n=random.normal(0.5, 0.2, t.force_n.size)) for t in trials]


def swapped_channels(trials: list[Trial]) -> list[Trial]:
    # Told of lengths that are none, amplitude and recovery would have the bag refused.
    facts = [replace(t.facts, amplitude_l0=None, recovery_s=None) for t in trials]
    return [
        replace(t, facts=told, length_m=1.0 + 0.05 * t.force_n, force_n=t.length_m)
        for t, told in zip(trials, facts, strict=True)
    ]


def shuffled_calcium(trials: list[Trial]) -> list[Trial]:
    """What was recorded at high calcium is said to be of low calcium, and the reverse."""
    others = [(trial.calcium_um, trial.facts.pca) for trial in reversed(trials)]
    return [
        replace(trial, calcium_um=calcium, facts=replace(trial.facts, pca=pca))
        for trial, (calcium, pca) in zip(trials, others, strict=True)
    ]


def only_one(trials: list[Trial]) -> list[Trial]:
    return trials[1:2]


@pytest.mark.parametrize("spoilt", [random_force, swapped_channels, shuffled_calcium, only_one])
def test_garbage_gets_no_name_and_is_told_what_is_missing(spoilt: Any, tmp_path: Path) -> None:
    trials = spoilt(study(truth("3state_coop+viscous_drag", drag=0.04)))
    found = diagnose_bags([write(tmp_path / "bags", trials)], FIBRE, tmp_path / "out", True, report=False)
    assert found["verdict"] not in ("physics", "ambiguous")
    assert not set(found["answer"]) & PHYSICS
    assert found["missing"]


def test_what_cannot_be_diagnosed_is_one_line(
    drag: tuple[Path, dict[str, Any]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, _ = drag
    bag = str(folder / "bags")
    assert main(["diagnose", bag, "--fiber", "nobody", "--out", str(tmp_path / "a")]) == 2
    assert main(["diagnose", bag, "--fiber", FIBRE, "--out", str(folder / "out")]) == 2
    error = capsys.readouterr().err
    assert "--overwrite" in error
    assert len(error.strip().splitlines()) == 2
    silent = replace(study(truth(), (6.0,))[0], force_time_s=np.empty(0), force_n=np.empty(0))
    write_trial(tmp_path / "bags" / "silent", silent)
    with pytest.raises(UserError, match="has no measured force"):
        diagnose_bags([tmp_path / "bags"], FIBRE, tmp_path / "b")
    dead = replace(study(truth(), (6.0,))[0], force_n=np.zeros(PROTOCOL.trial(FIBRE, 6.0).time_s.size))
    write_trial(tmp_path / "dead" / "dead", dead)
    with pytest.raises(UserError, match=r"force is 0 N in all .* samples; check the force channel"):
        diagnose_bags([tmp_path / "dead"], FIBRE, tmp_path / "c")
    assert not (tmp_path / "c" / "diagnosis.json").exists()
