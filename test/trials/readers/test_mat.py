"""MATLAB files of the data of Horslen et al. 2023: written here as the authors describe theirs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.protocol import SPEED_L0_PER_S, TEST_DURATION_S, TEST_STRETCH_L0
from xb_muscle_ros.trials.readers.assembly import trial_of
from xb_muscle_ros.trials.readers.settings import ImportSettings
from xb_muscle_ros.trials.trial import Trial

PCAS, ISIS, AMPS = [4.5, 6.1, 9.0], [1.0, 100.0], [0.0, 38.0, 383.0]
START_S = 0.005  # of the test stretch
ROWS = 900


def strain(time_s: np.ndarray, isi_ms: float, amp: float) -> np.ndarray:
    """Length change in L0 of the protocol, with the test stretch at 0.005 s."""
    ramp_s = amp * 1e-4 / SPEED_L0_PER_S
    corners = START_S + np.array(
        [-isi_ms / 1e3 - 2 * ramp_s, -isi_ms / 1e3 - ramp_s, -isi_ms / 1e3, 0, TEST_DURATION_S]
    )
    return np.interp(time_s, corners, [0.0, amp * 1e-4, 0.0, 0.0, TEST_STRETCH_L0])


def struct(not_measured: tuple[tuple[int, int, int], ...] = ()) -> dict[str, Any]:
    shape = (ROWS, len(PCAS), len(ISIS), len(AMPS))
    data: dict[str, Any] = {name: np.full(shape, np.nan) for name in ("Fexp", "Lexp", "texp")}
    for i, pca in enumerate(PCAS):
        for j, isi in enumerate(ISIS):
            for k, amp in enumerate(AMPS):
                if (i, j, k) in not_measured:
                    continue
                count = 700 + 50 * j + k  # the rest is padding
                time_s = (np.arange(count) - 550) / 1000
                data["texp"][:count, i, j, k] = time_s
                data["Lexp"][:count, i, j, k] = strain(time_s, isi, amp)
                data["Fexp"][:count, i, j, k] = 10.0 ** (-0.2 * pca) * (1 + 10 * strain(time_s, isi, amp))
    return {**data, "pCas": np.array(PCAS), "ISIs": np.array(ISIS), "AMPs": np.array(AMPS), "Act": np.ones(3)}


def write(path: Path, data: dict[str, Any], name: str = "data") -> Path:
    savemat(path, {name: data})
    return path


def read(path: Path, **keys: object) -> dict[str, Trial]:
    prepared = ImportSettings(keys, "here").prepare(path)
    return {
        pending.trial: trial_of(pending.read(), prepared.mapping, path)
        for pending in prepared.reader.trials(path, prepared.mapping)
    }


def test_every_cell_is_a_trial(tmp_path: Path) -> None:
    trials = read(write(tmp_path / "18Dec2017a.mat", struct()))
    assert len(trials) == 18
    trial = trials["18Dec2017a_amp383_rt100ms_pca61"]
    facts = trial.facts
    assert (facts.fibre, facts.pca, facts.amplitude_l0, facts.recovery_s) == ("18Dec2017a", 6.1, 0.0383, 0.1)
    assert (facts.reference_length_m, facts.f0_n) == (1.0, 1.0)
    assert trial.time_s.size == 752
    assert trial.time_s[0] == 0.0
    assert np.max(trial.length_change_l0) == pytest.approx(0.0383)
    assert trial.measured_f0[0] == pytest.approx(10**-1.22)
    assert trial.calcium_um == pytest.approx([10**-0.1])
    starts = {phase.name: phase.start_s for phase in facts.phases}
    assert list(starts) == ["isometric", "conditioning_stretch", "shortening", "recovery", "test_stretch", "hold"]
    assert starts["test_stretch"] == pytest.approx(0.555, abs=1e-3)
    assert "time 0.005 s of the file is 0.555 s here" in facts.source
    assert trial.warnings == ()


@pytest.mark.parametrize("name", ["amp0_rt1ms_pca45", "amp38_rt1ms_pca90", "amp38_rt100ms_pca61"])
def test_the_test_stretch_is_where_the_file_has_it(tmp_path: Path, name: str) -> None:
    trial = read(write(tmp_path / "f.mat", struct()))[f"f_{name}"]
    (test,) = (phase for phase in trial.facts.phases if phase.name == "test_stretch")
    assert test.start_s == pytest.approx(0.555, abs=1e-3)
    assert trial.warnings == ()


def test_cells_that_were_not_measured_are_no_trials(tmp_path: Path) -> None:
    trials = read(write(tmp_path / "f.mat", struct(((0, 0, 0), (2, 1, 2)))))
    assert len(trials) == 16
    assert "f_amp0_rt1ms_pca45" not in trials


@pytest.mark.parametrize("axes", [((1, 2), (0, 2), (0, 3)), ((0, 3), (1, 2), (0, 3)), ((1, 2), (1, 2), (2, 3))])
def test_axes_of_length_one_may_be_gone(tmp_path: Path, axes: tuple[tuple[int, int], ...]) -> None:
    data = struct()
    cut = tuple(slice(*axis) for axis in axes)
    for name in ("Fexp", "Lexp", "texp"):
        data[name] = data[name][(slice(None), *cut)]
    for name, part in zip(("pCas", "ISIs", "AMPs"), cut, strict=True):
        data[name] = data[name][part]
    found = read(write(tmp_path / "f.mat", data))
    assert len(found) == np.prod([end - begin for begin, end in axes])
    whole = read(write(tmp_path / "g" / "f.mat" if (tmp_path / "g").mkdir() is None else tmp_path, struct()))
    for name, trial in found.items():
        assert trial.force_n.tolist() == whole[name].force_n.tolist()


def test_a_mapping_names_other_fields_and_units(tmp_path: Path) -> None:
    data = struct()
    data["time_ms"] = 1000 * data.pop("texp")
    keys = {"fibre": "f7", "data_set": "set", "columns": {"time": {"column": "time_ms", "unit": "ms"}}}
    trial = read(write(tmp_path / "f.mat", data), **keys)["f_amp383_rt100ms_pca61"]
    assert (trial.facts.fibre, trial.facts.data_set) == ("f7", "set")
    assert trial.time_s[-1] == pytest.approx(0.751)
    assert trial.warnings == ()


def _changed(name: str, index: tuple[Any, ...], value: float) -> dict[str, Any]:
    data = struct()
    data[name][index] = value
    return data


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (_changed("Lexp", (slice(100, 150), 1, 1, 2), np.nan), "sample 101, Lexp is nan (a run of 50)"),
        (_changed("Fexp", (slice(740, None), 1, 1, 2), np.nan), "Lexp has 752 samples, Fexp 740; needed are equal"),
        (_changed("texp", (5, 1, 1, 2), -0.6), "sample 6, texp: -0.05 s does not come after 0.004 s"),
        (_changed("texp", (slice(None), 1, 1, 2), np.nan), "texp has no samples"),
        (_changed("pCas", (1,), np.nan), "pCas(2) is nan; needed is a number"),
        (_changed("pCas", (1,), 61.0), "pca is 61; allowed is 2 to 12"),
        (_changed("Fexp", (7, 1, 1, 2), 500.0), "sample 8, Fexp is 500 F0; allowed is -2 to 10"),
        (_changed("Lexp", (7, 1, 1, 2), 38.3), "sample 8, Lexp is 39.3 L0"),
    ],
)
def test_a_broken_cell_is_told_and_the_others_are_read(tmp_path: Path, data: dict[str, Any], words: str) -> None:
    path = write(tmp_path / "f.mat", data)
    prepared = ImportSettings({}, "here").prepare(path)
    problems, names = [], []
    for pending in prepared.reader.trials(path, prepared.mapping):
        names.append(pending.trial)
        try:
            trial_of(pending.read(), prepared.mapping, path)
        except UserError as problem:
            problems.append((pending.trial, str(problem)))
    assert len(names) == 18
    assert 1 <= len(problems) <= 6
    name, problem = problems[-1]
    assert words in problem
    assert problem.startswith(f"{path}, trial {name}")


def test_samples_without_a_time_are_left_out_with_a_warning(tmp_path: Path) -> None:
    data = _changed("texp", (slice(700, None), 1, 1, 2), np.nan)
    trial = read(write(tmp_path / "f.mat", data))["f_amp383_rt100ms_pca61"]
    assert trial.time_s.size == trial.force_n.size == 700
    (warning,) = trial.warnings
    assert "752 samples have 700 times; those without a time are left out" in warning


def test_a_test_stretch_elsewhere_is_pointed_out(tmp_path: Path) -> None:
    data = struct()
    data["texp"] += 0.05
    trial = read(write(tmp_path / "f.mat", data))["f_amp383_rt100ms_pca61"]
    (warning,) = trial.warnings
    assert "shows the test stretch at 0.55" in warning
    assert "the file tells of one at 0.505 s" in warning


def _without(name: str) -> dict[str, Any]:
    data = struct()
    del data[name]
    return data


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (_without("AMPs"), "struct data has no AMPs; its fields: "),
        (_without("Fexp"), "struct data has no Fexp"),
        ({**struct(), "ISIs": np.array([1.0])}, "Lexp has shape (900, 3, 2, 3); needed are samples x (3, 1, 3)"),
        ({**struct(), "Lexp": "no numbers"}, "data.Lexp holds no numbers"),
    ],
)
def test_a_file_that_does_not_fit_is_refused(tmp_path: Path, data: dict[str, Any], words: str) -> None:
    with pytest.raises(UserError) as refused:
        read(write(tmp_path / "f.mat", data))
    assert words in str(refused.value).replace("texp has shape", "Lexp has shape")


def test_what_is_no_such_file_is_refused(tmp_path: Path) -> None:
    write(tmp_path / "other.mat", struct(), "results")
    (tmp_path / "cut.mat").write_bytes(write(tmp_path / "f.mat", struct()).read_bytes()[:50000])
    (tmp_path / "no.mat").write_text("text")
    (tmp_path / "new.mat").write_bytes(b"MATLAB 7.3 MAT-file" + b" " * 105 + b"\x00\x02IM" + b"\x89HDF\r\n\x1a\n")
    for name, words in (
        ("other.mat", "has no struct 'data'"),
        ("cut.mat", "is no whole MATLAB file"),
        ("no.mat", "is no whole MATLAB file"),
        ("new.mat", "is no whole MATLAB file"),
    ):
        with pytest.raises(UserError, match=words) as refused:
            read(tmp_path / name)
        assert name in str(refused.value)
