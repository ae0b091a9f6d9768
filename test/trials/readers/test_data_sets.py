"""Every data set that has a mapping file, imported and held against facts read off the files by other means.

The facts (samples, rates, ranges, forces) come from spreadsheets and plots of the files, not from the code under test.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy.io import savemat

from xb_muscle_ros.trials.bags import find_bags, read_trial
from xb_muscle_ros.trials.importing import Failed, FileDone, Imported, import_recordings
from xb_muscle_ros.trials.readers.mapping import load_mapping
from xb_muscle_ros.trials.readers.settings import ImportSettings
from xb_muscle_ros.trials.trial import Trial

# What its tests share takes long to make.
pytestmark = pytest.mark.slow


class DataSet(NamedTuple):
    mapping: str
    files: str  # pattern below the folder of recordings
    trials: int
    rate_hz: float
    warnings: int


SETS = {
    "protocol": DataSet("rat_soleus_18Dec2017a", "rat_soleus_18Dec2017a/amp*.csv", 5, 1000.0, 0),
    "triangles": DataSet("rat_soleus_18Dec2017a_triangles", "rat_soleus_18Dec2017a/triangle*.csv", 4, 1000.0, 2),
    "ktr": DataSet("rat_soleus_ktr", "rat_soleus_ktr/*/*.slc", 8, 2500.0, 8),
    "gm": DataSet("rat_gastrocnemius_in_situ", "rat_gastrocnemius_in_situ/*.csv", 15, 1000.0, 0),
    "cat": DataSet("cat_soleus_herzog_leonard_2002", "cat_soleus_herzog_leonard_2002/*.csv", 15, 100.0, 0),
}


@pytest.fixture(scope="module")
def trials(repo_root: Path, shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Trial]]:
    """Trials by data set and name."""
    out = tmp_path_factory.mktemp("data_sets")
    found = {}
    for name, data_set in {**SETS, "mouse": MOUSE}.items():
        mapping = repo_root / "scripts" / "datasets" / f"{data_set.mapping}.yaml"
        files = sorted((shared_data / "recordings").glob(data_set.files))
        settings = ImportSettings(load_mapping(mapping), mapping.name)
        made = {}
        for event in import_recordings(files, settings, out / name):
            assert not isinstance(event, Failed), event
            if isinstance(event, Imported):
                made[event.trial.facts.trial] = event.trial
        found[name] = made
        # One of each set, as it comes back from its bag.
        back = read_trial(find_bags([out / name])[-1])
        assert back.facts == made[back.facts.trial].facts
        for field in ("time_s", "length_m", "calcium_um", "force_n"):
            assert getattr(back, field).tolist() == getattr(made[back.facts.trial], field).tolist()
    return found


# Resampled evenly in the logarithm of time, so it has no rate.
MOUSE = DataSet("mouse_trabecula_titin", "mouse_trabecula_titin/*.csv", 10, 0.0, 0)


@pytest.mark.parametrize("name", list(SETS))
def test_counts_and_rates(trials: dict[str, dict[str, Trial]], name: str) -> None:
    assert len(trials[name]) == SETS[name].trials
    for trial in trials[name].values():
        assert 1.0 / np.median(np.diff(trial.time_s)) == pytest.approx(SETS[name].rate_hz, rel=1e-6)
        assert trial.facts.data_set == SETS[name].mapping.replace("_triangles", "")
        assert "L0" in trial.facts.source
        assert "F0" in trial.facts.source
        assert trial.force_n.size == trial.time_s.size


def test_warnings_come_with_the_import(repo_root: Path, shared_data: Path, tmp_path: Path) -> None:
    data_set = SETS["triangles"]
    mapping = repo_root / "scripts" / "datasets" / f"{data_set.mapping}.yaml"
    files = sorted((shared_data / "recordings").glob(data_set.files))
    events = import_recordings(files, ImportSettings(load_mapping(mapping), "m"), tmp_path)
    told = [event.trial.warnings for event in events if isinstance(event, Imported)]
    assert sum(map(len, told)) == data_set.warnings


def _names(trial: Trial) -> list[str]:
    return [phase.name for phase in trial.facts.phases]


def _between(trial: Trial, from_s: float, to_s: float) -> float:
    """Mean measured force in F0."""
    return float(np.mean(trial.measured_f0[(trial.force_time_s >= from_s) & (trial.force_time_s < to_s)]))


def _held(trial: Trial, time_s: np.ndarray) -> np.ndarray:
    """Calcium in µM: a value holds until the next one."""
    return trial.calcium_um[np.searchsorted(trial.calcium_time_s, time_s, side="right") - 1]


# k_tr: pCa noted in the header, and mean stress before the release over that at pCa 4.5 (122.34 kPa): from a
# spreadsheet, volts over those in the slack, times 0.6162 mN/V over 4.658e-9 m2.
KTR = {
    "45pCa1": (4.5, 1.0),
    "54pCa1": (5.4, 0.979),
    "56pCa1": (5.6, 0.976),
    "59pCa1": (5.9, 1.002),
    "62pCa1": (6.2, 0.778),
    "64pCa6": (6.4, 0.630),
    "66pCa1": (6.6, 0.301),
    "90pCa1": (9.0, 0.082),
}


@pytest.mark.parametrize("name", list(KTR))
def test_rat_soleus_ktr(trials: dict[str, dict[str, Trial]], name: str) -> None:
    trial = trials["ktr"][f"ACB11_{name}"]
    pca, force_f0 = KTR[name]
    assert (trial.facts.fibre, trial.facts.pca) == ("ACB11", pca)
    assert trial.time_s.size == 15000
    assert trial.time_s[-1] == pytest.approx(5.9996)  # 15,000 samples at 0.4 ms, not at the 1 ms of the header
    assert trial.facts.reference_length_m == pytest.approx(1.247e-3, rel=1e-4)
    assert trial.facts.f0_n == pytest.approx(122.34e3 * 4.658e-9, rel=2e-3)
    assert _between(trial, 0.0, 1.4) == pytest.approx(force_f0, abs=0.003)
    # The header tells of a step of 249.4 um for 20 ms.
    slack = (trial.time_s > 1.512) & (trial.time_s < 1.528)
    assert np.mean(trial.length_change_l0[slack]) * 1247 == pytest.approx(-249.4, abs=1.5)
    assert _between(trial, 1.522, 1.528) == pytest.approx(0.0, abs=0.003)
    assert _names(trial) == ["isometric", "release", "hold", "stretch", "recovery"]
    starts_s = [phase.start_s for phase in trial.facts.phases]
    assert starts_s == pytest.approx([0.0, 1.5092, 1.5096, 1.5296, 1.53], abs=5e-4)


# Gastrocnemius: samples, begin and end of stimulation in ms, peak force in N, shortest and longest length in mm.
GM = {
    "ISOM01": (2055, [(533, 628)], 7.35, 40.42, 40.60),
    "ISOM06": (2040, [(522, 557)], 3.87, 40.38, 40.64),
    "ISOM12": (2041, [(532, 597)], 13.20, 46.37, 46.86),
    "QR03": (1945, [(513, 968)], 5.72, 39.29, 40.52),
    "QR07": (1732, [(524, 779)], 13.09, 43.28, 43.65),
    "SR01": (1821, [(514, 819)], 13.91, 42.79, 44.50),
    "SR09": (1815, [(506, 811)], 14.04, 32.10, 44.50),
    "SSC_PA01_1": (5037, [(1011, 1416), (2011, 2416), (3011, 3416)], 12.35, 41.50, 45.50),
    "SSC_PA05_2": (1044, [(240, 295), (440, 495), (640, 695)], 5.92, 41.50, 45.50),
}
CYCLES = ["shortening", "stretch"] * 5
GM_PHASES = {
    "ISOM": ["isometric"],
    "QR": ["isometric", "release", "recovery"],
    "SR": ["isometric", "release", "shortening", "recovery"],
}


@pytest.mark.parametrize("name", list(GM))
def test_rat_gastrocnemius(trials: dict[str, dict[str, Trial]], name: str) -> None:
    trial = trials["gm"][f"GMe1_{name}"]
    samples, stimulated_ms, peak_n, shortest_mm, longest_mm = GM[name]
    assert (trial.facts.fibre, trial.time_s.size, trial.facts.f0_n) == ("GMe1", samples, 15.5)
    assert np.max(trial.force_n) == pytest.approx(peak_n, abs=0.01)
    # L0, 13.7 mm, where muscle and tendon measure 42.5 mm.
    length_mm = 1e3 * trial.length_m - 13.7 + 42.5
    assert (np.min(length_mm), np.max(length_mm)) == pytest.approx((shortest_mm, longest_mm), abs=0.01)
    for begin_ms, end_ms in stimulated_ms:
        assert f"{begin_ms / 1000:g} to {end_ms / 1000:g} s" in trial.facts.source
    calcium = _held(trial, trial.time_s)
    first_on, last_off = stimulated_ms[0][0], stimulated_ms[-1][1]
    assert np.all(calcium[:first_on] == 0.05)
    assert calcium[last_off + 300] < 0.06
    # With 55.2 ms to 8 uM from 0.05 uM, at the end of the first tetanus:
    expected = 8.0 - 7.95 * np.exp(-(stimulated_ms[0][1] - first_on) / 55.2)
    assert np.max(calcium[: stimulated_ms[0][1] + 5]) == pytest.approx(expected, rel=5e-3)
    # Force rises while there is calcium, and not before.
    assert abs(np.max(trial.force_n[:first_on]) - trial.force_n[0]) < 0.1
    assert trial.facts.pca is None


@pytest.mark.parametrize("kind", list(GM_PHASES))
def test_phases_of_the_gastrocnemius(trials: dict[str, dict[str, Trial]], kind: str) -> None:
    found = {name: trial for name, trial in trials["gm"].items() if name.startswith(f"GMe1_{kind}")}
    assert len(found) == {"ISOM": 3, "QR": 2, "SR": 4}[kind]
    for trial in found.values():
        assert _names(trial) == GM_PHASES[kind]


# Begin of the release, end of the ramp: s, from plots.
@pytest.mark.parametrize(
    ("name", "starts_s"),
    [
        ("QR03", [0.915, 0.925]),
        ("QR07", [0.726, 0.737]),
        ("SR01", [0.716, 0.730, 0.822]),
        ("SR03", [0.715, 0.728, 0.821]),
        ("SR06", [0.732, 0.745, 0.838]),
        ("SR09", [0.708, 0.720, 0.813]),
    ],
)
def test_releases_of_the_gastrocnemius(trials: dict[str, dict[str, Trial]], name: str, starts_s: list[float]) -> None:
    found = [phase.start_s for phase in trials["gm"][f"GMe1_{name}"].facts.phases[1:]]
    assert found == pytest.approx(starts_s, abs=3e-3)


def test_cycles_of_the_gastrocnemius(trials: dict[str, dict[str, Trial]]) -> None:
    cycles = {name: trial for name, trial in trials["gm"].items() if "SSC" in name}
    assert len(cycles) == 6
    for trial in cycles.values():
        names = _names(trial)
        assert names[0] == "isometric"
        assert names[1:11] == CYCLES
        assert names[11:] in ([], ["hold"])


# Cat: samples, change of length at begin and end in mm, speed in mm/s, end of stimulation in s (None: passive),
# and mean total force from 1.8 to 2.3 s in N, from plots and a spreadsheet.
CAT = {
    "fig5_trial31": (1500, 0, 0, 0, 9.95, 31.6),
    "fig5_trial32": (1500, 9, 9, 0, 9.95, 28.0),
    "fig5_trial37": (1500, 0, 9, 3, 10.2, 33.0),
    "fig6and7A_trial43": (1500, 0, 0, 0, 10.05, 21.1),
    "fig6and7A_trial45": (1500, 6, 9, 3, 10.1, 21.9),
    "fig6and7A_trial47": (1500, 3, 9, 3, 10.0, 21.6),
    "fig6and7A_trial49": (1500, 0, 9, 3, None, 0.45),
    "fig6and7A_trial50": (1500, 0, 9, 3, 9.95, 21.7),
    "fig7C_trial59": (1280, 0, 0, 0, 7.65, 20.8),
    "fig7C_trial60": (1280, 9, 9, 0, 7.6, 21.9),
    "fig7C_trial61": (1280, 6, 9, 27, 7.55, 21.2),
    "fig7C_trial63": (1280, 3, 9, 27, 7.5, 21.0),
    "fig7C_trial65": (1280, 0, 9, 27, 7.5, 20.8),
    "fig7C_trial66": (1280, 0, 9, 27, None, 0.39),
}


@pytest.mark.parametrize("name", list(CAT))
def test_cat_soleus(trials: dict[str, dict[str, Trial]], name: str) -> None:
    trial = trials["cat"][name]
    samples, from_mm, to_mm, speed, end_s, force_n = CAT[name]
    assert trial.time_s.size == samples
    assert (trial.facts.fibre, trial.facts.f0_n) == (
        ("cat_soleus_fig5", 32.5) if name.startswith("fig5") else ("cat_soleus_fig6_7", 21.2)
    )
    change_mm = 1e3 * (trial.length_m - 0.0428)
    assert np.mean(change_mm[:100]) == pytest.approx(from_mm, abs=0.1)
    assert np.mean(change_mm[-100:]) == pytest.approx(to_mm, abs=0.1)
    assert _between(trial, 1.8, 2.3) * trial.facts.f0_n == pytest.approx(force_n, abs=0.5)
    if speed:
        assert _names(trial) == ["isometric", "test_stretch", "hold"]
        ramp = trial.facts.phases[1]
        assert (to_mm - from_mm) / (ramp.end_s - ramp.start_s) == pytest.approx(speed, rel=0.06)
    else:
        assert _names(trial) == ["isometric"]
    if end_s is None:
        assert trial.calcium_um.tolist() == [0.05]
        assert "stimulated never" in trial.facts.source
        return
    at_s = np.array([0.99, 1.05, 2.0, end_s - 0.15, end_s + 0.6])
    calcium = _held(trial, at_s)
    assert calcium[0] == 0.05
    assert calcium[1] == pytest.approx(8.0 - 7.95 / np.e, rel=0.01)
    assert calcium[2:4] == pytest.approx([8.0, 8.0], rel=2e-3)
    assert calcium[4] < 0.06


# Mouse: samples, pCa, duration of the ramp in s, first and largest force in kPa.
MICE = {
    "AvgMava_pCa4.4_0.1s": (100, 4.4, 0.1, 0.77, 50.71),
    "AvgMava_pCa4.4_10s": (100, 4.4, 10.0, 0.39, 13.88),
    "AvgMava_pCa5.8_0.1s": (100, 5.8, 0.1, 0.51, 39.02),
    "AvgMava_pCa6.2_0.1s": (100, 6.2, 0.1, 0.88, 18.84),
    "AvgRelaxed_0.1s": (119, 11.0, 0.1, 0.41, 17.06),
    "AvgRelaxed_10s": (99, 11.0, 10.0, 0.22, 9.68),
    "AvgpCa4.4_0.1s": (100, 4.4, 0.1, 0.37, 45.61),
    "AvgpCa4.4_10s": (100, 4.4, 10.0, 0.08, 19.88),
    "AvgpCa5.75_0.1s": (60, 5.75, 0.1, 0.23, 29.27),
    "AvgpCa6.25_0.1s": (60, 6.25, 0.1, 0.53, 16.48),
}


@pytest.mark.parametrize("name", list(MICE))
def test_mouse_trabecula(trials: dict[str, dict[str, Trial]], name: str) -> None:
    trial = trials["mouse"][name]
    samples, pca, ramp_s, first_kpa, largest_kpa = MICE[name]
    assert (trial.time_s.size, trial.facts.pca) == (samples, pca)
    assert trial.length_m[0] == pytest.approx(0.95, abs=5e-4)
    assert trial.length_m[-1] == pytest.approx(1.1755, abs=5e-4)
    assert 50 * trial.measured_f0[0] == pytest.approx(first_kpa, abs=0.01)
    assert 50 * np.max(trial.measured_f0) == pytest.approx(largest_kpa, abs=0.01)
    assert _names(trial) == ["test_stretch", "hold"]
    stretch = trial.facts.phases[0]
    assert (stretch.start_s, stretch.end_s - stretch.start_s) == pytest.approx((2.0, ramp_s), rel=5e-3)


def test_every_mapping_file_is_tried(repo_root: Path) -> None:
    there = {path.stem for path in (repo_root / "scripts" / "datasets").glob("*.yaml")}
    # The MATLAB files are not to be had; test_mat has files like them. The fibres are named by folders, which
    # test_between_samples has.
    elsewhere = {"horslen_2023", "rat_soleus_fibres"}
    assert there == {each.mapping for each in (*SETS.values(), MOUSE)} | elsewhere


@pytest.mark.parametrize(
    ("mapping", "names"),
    [
        ("rat_gastrocnemius_in_situ", ["GMe1_ISOM02", "GMe2_QR10", "GMe3_SSC_PA12_2"]),
        ("cat_soleus_herzog_leonard_2002", ["fig5_trial38", "fig7B_trial55"]),
        (
            "mouse_trabecula_titin",
            ["AvgMava_pCa6.0_1s", "AvgpCa6_0.1s", "AvgRelaxedMavaSet_100s", "AvgMavaSetpCa4.4_1s"],
        ),
        ("rat_soleus_ktr", ["58pCa2"]),
        ("horslen_2023", ["7Aug2018a"]),
    ],
)
def test_other_files_of_the_sets_have_a_mapping_too(
    repo_root: Path, tmp_path: Path, mapping: str, names: list[str]
) -> None:
    tree = load_mapping(repo_root / "scripts" / "datasets" / f"{mapping}.yaml")
    suffix = {"rat_soleus_ktr": ".slc", "horslen_2023": ".mat"}.get(mapping, ".csv")
    if suffix == ".slc":
        tree["f0"] = "0.57 mN"  # there is no trial at pCa 4.5 beside it
    settings = ImportSettings(tree, mapping)
    for name in names:
        file = tmp_path / f"{name}{suffix}"
        if suffix == ".mat":  # it tells that it is of that layout
            savemat(file, {"data": {"pCas": [4.5]}})
        else:
            file.write_text("made for its name")
        prepared = settings.prepare(file)
        assert prepared.mapping.facts_of(file)["pca"] == {
            "AvgMava_pCa6.0_1s": 6.0,
            "AvgpCa6_0.1s": 6.0,
            "AvgRelaxedMavaSet_100s": 11.0,
            "AvgMavaSetpCa4.4_1s": 4.4,
        }.get(name)


def test_events_end_each_file(repo_root: Path, shared_data: Path, tmp_path: Path) -> None:
    mapping = repo_root / "scripts" / "datasets" / "mouse_trabecula_titin.yaml"
    files = sorted((shared_data / "recordings").glob(MOUSE.files))
    events = list(import_recordings(files, ImportSettings(load_mapping(mapping), "m"), tmp_path))
    assert [event.path for event in events if isinstance(event, FileDone)] == files
