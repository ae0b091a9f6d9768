"""Studies of one fibre and of several: which trials go to which fibre, and what is refused in one line."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import foreign_bags as foreign
import numpy as np
import pytest

from xb_muscle_ros.diagnose.intake import FibreStudy, read_fibres
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import find_fibre_file, load_fibre
from xb_muscle_ros.scores.noise.model import Source
from xb_muscle_ros.scores.noise.trials import noise_of
from xb_muscle_ros.scores.standard_error import force_noise
from xb_muscle_ros.trials.bags import write_trial
from xb_muscle_ros.trials.completing import Known
from xb_muscle_ros.trials.importing import Imported, import_recordings
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.readers.mapping import load_mapping
from xb_muscle_ros.trials.readers.settings import ImportSettings

A, B, C = "14Dec2017b", "18Dec2017a", "19Dec2017a"
Make = Callable[..., Path]


@pytest.fixture
def make(tmp_path: Path) -> Make:
    """Makes a bag: (fibre, pca, amplitude_l0=, recovery_s=, force_f0=, rate_hz=, folder=)."""

    def bag(
        fibre: str,
        pca: float,
        amplitude_l0: float = 0.0383,
        recovery_s: float = 0.1,
        force_f0: float | None = 0.5,
        rate_hz: float = 1000.0,
        folder: str = "bags",
    ) -> Path:
        trial = StretchShortenStretch(amplitude_l0, recovery_s).trial(fibre, pca, rate_hz)
        if force_f0 is not None:
            trial = replace(trial, force_time_s=trial.time_s, force_n=force_f0 + trial.length_m - 1.0)
            trial = replace(trial, force_n=trial.force_n * bool(force_f0))
        path = tmp_path / folder / f"{fibre}_{trial.facts.trial}"
        write_trial(path, trial)
        return path

    return bag


def test_one_fibre_takes_all_bags_whatever_they_name(make: Make) -> None:
    bags = [make("somebody", 6.1), make(A, 6.2)]
    (study,) = read_fibres(bags, [B])
    assert isinstance(study, FibreStudy)
    assert study.fibre.name == B
    assert [trial.facts.fibre for trial in study.trials] == ["somebody", A]
    # A is a fibre of the package, B the one whose file was given.
    assert study.notes == (f"trials of fibres somebody, {A} are diagnosed as those of {B}, the one file given",)
    (own,) = read_fibres([make(B, 6.1)], [B])
    assert own.notes == ()


def test_trials_go_to_the_fibre_they_name_in_the_order_of_recording(make: Make) -> None:
    bags = [make(B, 6.2), make(A, 6.2), make(B, 4.5), make(A, 6.1)]
    first, second = read_fibres(bags, [load_fibre(name, "2state_coop") for name in (A, B)], Known(f0_n=2.0))
    assert (first.fibre.name, second.fibre.name) == (A, B)
    assert {first.fibre.model, second.fibre.model} == {"2state_coop"}
    assert [trial.facts.pca for trial in first.trials] == [6.2, 6.1]
    assert [trial.facts.pca for trial in second.trials] == [6.2, 4.5]
    assert {trial.facts.f0_n for s in (first, second) for trial in s.trials} == {2.0}


def test_coarse_samples_are_told_by_fibre(make: Make) -> None:
    bags = [make(A, 6.1, rate_hz=166.6), make(B, 6.1, folder="fine")]
    coarse, fine = read_fibres(bags, [A, B])
    assert coarse.notes == (
        "corners of length between samples were recovered (1 trial)",
        "SRS cannot be measured in 1 of 1 stretched trials (in amp383_rt100ms_pca61: 2 samples in the first 10 ms of "
        "the stretch; 3 are needed)",
    )
    assert fine.notes == ()


def _refused(bags: list[Path], fibers: list[str], **more: object) -> str:
    with pytest.raises(UserError) as refusal:
        read_fibres(bags, fibers, **more)
    line = str(refusal.value)
    assert "\n" not in line
    return line


def test_fibres_without_bags_name_both_lists(make: Make) -> None:
    line = _refused([make(A, 6.1), make(B, 6.1)], [A, B, C])
    assert line == (
        f"no bag is of fibre '{C}'; fibre files are of '{A}', '{B}', '{C}'; bags are of '{A}', '{B}'; give its bags too"
    )


def test_bags_of_a_fibre_without_file_are_refused(make: Make) -> None:
    bags = [make(A, 6.1), make(B, 6.1), make(C, 6.1), make(C, 6.2)]
    line = _refused(bags, [A, B])
    assert line.startswith(f"bag {bags[2]} is of fibre '{C}', which has no fibre file (and 1 more bags)")
    assert f"fibre files are of '{A}', '{B}'" in line


def test_a_fibre_is_given_once(make: Make) -> None:
    line = _refused([make(A, 6.1)], [A, str(find_fibre_file(A))])
    assert line.startswith(f"fibre '{A}' is given 2 times (")
    assert line.endswith("give each fibre once")


def test_fibres_that_share_no_condition_say_what_each_has(make: Make) -> None:
    line = _refused([make(A, 6.1), make(B, 6.2), make(B, 6.1, amplitude_l0=0.0)], [A, B])
    assert f"fibre {A} shares no condition (pCa and protocol)" in line
    assert f"{A} has test stretch after 3.83 % L0 and 0.1 s at pCa 6.1" in line
    assert f"{B} has test stretch after 3.83 % L0 and 0.1 s at pCa 6.2, test stretch alone at pCa 6.1" in line


def test_chains_of_fibres_share_conditions(make: Make) -> None:
    bags = [make(A, 6.1), make(B, 6.1), make(B, 6.2), make(C, 6.2)]
    assert [len(s.trials) for s in read_fibres(bags, [A, B, C])] == [1, 2, 1]
    # A repeat that was measured rather than planned, and a solution that is off by an error of pipetting.
    near = [make(A, 6.1, folder="near"), make(B, 6.11, amplitude_l0=0.0377, folder="near")]
    assert len(read_fibres(near, [A, B])) == 2


def test_different_base_models_are_named(make: Make, tmp_path: Path) -> None:
    text = find_fibre_file(B).read_text(encoding="utf-8")
    other = tmp_path / "other.yaml"
    other.write_text(text.replace("model: 3state_coop\n", "model: 2state_coop\n"), encoding="utf-8")
    bags = [make(A, 6.1), make(B, 6.1)]
    line = _refused(bags, [A, str(other)])
    assert line == (
        f"fibre files start from different models, {A}: 3state_coop, {B}: 2state_coop; give one for all with --model"
    )
    assert len(read_fibres(bags, [load_fibre(name, "2state_coop") for name in (A, other)])) == 2


@pytest.mark.parametrize("fibers", [[A], [A, B]])
def test_trials_without_force_are_refused_by_name(make: Make, fibers: list[str]) -> None:
    others = [make(B, 6.1)] if B in fibers else []
    line = _refused([make(A, 6.1, force_f0=None), make(A, 6.2), *others], fibers)
    assert line == (
        f"fibre {A}: trial amp383_rt100ms_pca61 has no measured force; a diagnosis needs it, leave the bag out"
    )
    silent = [make(A, 6.1, force_f0=0.0, folder="silent"), *others]
    assert "measured force is 0 N in all" in _refused(silent, fibers)


def test_the_rest_is_refused_in_one_line(make: Make, tmp_path: Path) -> None:
    assert "no bags" in _refused([], [A])
    assert "no fibre file" in _refused([make(A, 6.1)], [])
    assert "--trials-of x takes the trials of one fibre" in _refused([make(A, 6.1)], [A, B], only="x")
    assert "does not exist" in _refused([tmp_path / "none"], [A, B])
    assert "is not known" in _refused([make(A, 6.1)], [A, "nobody"])


def test_several_fibres_in_one_bag(tmp_path: Path, make: Make) -> None:
    """What a bath holds side by side: one bag with both fibres' lengths and forces."""
    trial = StretchShortenStretch(0.0383, 0.1).trial(A, 6.1)
    trial = replace(trial, force_time_s=trial.time_s, force_n=0.5 + 0.0 * trial.time_s)
    bag = foreign.write_folder(tmp_path / "both", [foreign.messages(trial, {B: 1.0})], None)
    first, second = read_fibres([bag], [A, B])
    assert [len(first.trials), len(second.trials)] == [1, 1]
    assert (first.trials[0].facts.fibre, second.trials[0].facts.fibre) == (A, B)
    assert np.array_equal(first.trials[0].force_n, second.trials[0].force_n)


@pytest.mark.slow
def test_real_fibres(shared_data: Path, make: Make) -> None:
    """The five rat fibres share conditions that were stated apart in files' names."""
    names = sorted(p.name for p in (shared_data / "recordings" / "rat_soleus_fibres").iterdir())
    bags = []
    for name in names:
        for file in sorted((shared_data / "recordings" / "rat_soleus_fibres" / name).glob("amp383*.csv")):
            bags.append(make(name, float(file.stem[-2:]) / 10.0))
    studies = read_fibres(bags, names)
    assert [s.fibre.name for s in studies] == names
    assert sum(len(s.trials) for s in studies) == len(bags)


def test_coarse_recordings_without_phases_are_read_and_said(shared_data: Path, repo_root: Path, tmp_path: Path) -> None:
    """84 ms of rest, samples 6 ms apart and no phases: found from length, as good as the protocol's."""
    mapping = load_mapping(repo_root / "scripts" / "datasets" / "rat_soleus_fibres.yaml")
    settings = ImportSettings({**mapping, "fibre": A}, "test")
    files = sorted((shared_data / "recordings" / "rat_soleus_fibres" / A).glob("*.csv"))
    for event in import_recordings(files, settings, tmp_path / "whole"):
        if isinstance(event, Imported):
            bare = replace(event.trial, facts=replace(event.trial.facts, phases=()))
            write_trial(tmp_path / "bare" / event.bag.name, bare)
    (whole,) = read_fibres([tmp_path / "whole"], [A])
    (bare,) = read_fibres([tmp_path / "bare"], [A])
    assert "phases found from length (10 trials)" in bare.notes
    assert "corners of length between samples were recovered (10 trials)" in bare.notes
    assert any(line.startswith("SRS cannot be measured in 10 of 10 stretched trials") for line in bare.notes)
    for one, other in zip(whole.trials, bare.trials, strict=True):
        assert [p.name for p in one.facts.phases] == [p.name for p in other.facts.phases]
        starts = [[p.start_s for p in trial.facts.phases] for trial in (one, other)]
        assert starts[0] == pytest.approx(starts[1], abs=1e-4)
        assert np.array_equal(one.time_s, other.time_s)
    noise = noise_of(bare.trials)
    assert all(5e-5 < each.sd_f0 < 1e-2 for each in noise.trials)
    assert {each.source for each in noise.trials} == {Source.CURVE}
    # So that their isometric forces have standard errors.
    assert all(force_noise(trial) is not None for trial in bare.trials)
