"""Tables of features beside traces: whose they are, what they share with trials, and what a model predicts of them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.diagnose.feature_tables import FeatureTable, read_features, seen
from xb_muscle_ros.diagnose.featuring import as_table, relative_srs_rmsd
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.evaluate import grid
from xb_muscle_ros.evaluate.srs_scores import READINGS, score
from xb_muscle_ros.fit.features import Feature, simulated
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.plain import fibre_to_plain
from xb_muscle_ros.scores.conditions import CONDITIONS, Condition
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.trial import Trial

A, B = "14Dec2017b", "18Dec2017a"
PCAS, RECOVERIES, AMPLITUDES = (4.5, 6.2), (0.001, 0.1), (0.0, 0.0383)


def trials_at(*pcas: float) -> list[Trial]:
    """The paper's two fitted protocols in some solutions."""
    protocols = (StretchShortenStretch(0.0, 0.001), StretchShortenStretch(0.0383, 0.1))
    return [protocol.trial(A, pca) for pca in pcas for protocol in protocols]


def table(path: Path, names: Sequence[str] = (A, B), **changes: Any) -> Path:
    """A small table; every fibre has the same values, one cell was not measured."""
    shape = (len(PCAS), len(RECOVERIES), len(AMPLITUDES))
    test = np.full(shape, 20.0).tolist()
    test[0][0][1] = None
    isometric = np.broadcast_to(np.array([1.0, 0.4])[:, None, None], shape).tolist()
    conditioning = [[[None, 30.0], [None, 32.0]], [[None, 14.0], [None, None]]]
    cells = {"srs_test": test, "srs_conditioning": conditioning, "isometric_force": isometric}
    tree = {"pCa": PCAS, "recovery_s": RECOVERIES, "amplitude_L0": AMPLITUDES, "fibres": dict.fromkeys(names, cells)}
    path.write_text(json.dumps({**tree, **changes}), encoding="utf-8")
    return path


def test_every_measured_cell_of_the_studys_fibres_is_a_feature(tmp_path: Path) -> None:
    found = read_features(table(tmp_path / "t.json"), {B: trials_at(4.5, 6.2)})
    assert list(found.features) == list(found.cells) == [B]
    cells = found.cells[B]
    assert [f.kind for f in cells].count("srs_test") == 7
    by_kind = {(f.kind, f.pca): f.value for f in cells if f.kind != "srs_test"}
    assert by_kind == {
        ("isometric_force", 4.5): 1.0, ("srs_conditioning", 4.5): 31.0,
        ("isometric_force", 6.2): 0.4, ("srs_conditioning", 6.2): 14.0,
    }  # fmt: skip
    assert {(f.kind, f.pca, f.recovery_s, f.amplitude_l0, f.value) for f in found.features[B]} == {
        (f.kind, f.pca, f.recovery_s, f.amplitude_l0, f.value) for f in cells
    }
    assert found.notes == ()


def test_what_is_missing_or_met_in_no_trial_is_told(tmp_path: Path) -> None:
    path = table(tmp_path / "t.json", [A])
    found = read_features(path, {A: trials_at(6.2), B: trials_at(6.2)})
    assert found.notes == (
        f"features {path} have nothing of fibre {B}",
        f"features {path} in solutions of no trial, taken without a pCa shift: {A} at pCa 4.5",
    )


def _refused(path: Path, trials: Mapping[str, Sequence[Trial]]) -> str:
    with pytest.raises(UserError) as refusal:
        read_features(path, trials)
    line = str(refusal.value)
    assert "\n" not in line
    return line


def test_tables_that_do_not_belong_to_the_study_are_refused(tmp_path: Path) -> None:
    path = table(tmp_path / "t.json", [B])
    assert _refused(path, {A: trials_at(6.2)}) == (
        f"features {path} are of '{B}'; the trials are of '{A}'; give the table of a fibre of the study"
    )
    line = _refused(table(tmp_path / "t.json"), {A: trials_at(6.1), B: trials_at(6.3)})
    assert "have no condition in common with the trials" in line
    assert f"{A}: features at pCa 4.5, 6.2, trials at 6.1" in line
    assert f"{B}: features at pCa 4.5, 6.2, trials at 6.3" in line


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"pCa": "6.1"}, "axis 'pCa' is missing or not a list of numbers"),
        ({"recovery_s": [1.0, 100000.0]}, "recovery_s 100000 is outside"),
        ({"fibres": {}}, "'fibres' is missing or empty"),
        ({"fibres": {A: {"srs_test": []}}}, "srs_test holds 0 values"),
    ],
)
def test_unreadable_tables_are_refused(tmp_path: Path, change: dict[str, Any], words: str) -> None:
    assert words in _refused(table(tmp_path / "t.json", **change), {A: trials_at(6.2)})


def test_files_that_are_no_tables_are_refused(tmp_path: Path) -> None:
    assert "cannot be read" in _refused(tmp_path / "none.json", {A: trials_at(6.2)})
    broken = tmp_path / "broken.json"
    broken.write_text("{", encoding="utf-8")
    assert "is not valid JSON" in _refused(broken, {A: trials_at(6.2)})


def test_features_that_traces_show_are_told_from_concealed_ones() -> None:
    def of(kind: str, pca: float, recovery_s: float = 0.0, amplitude_l0: float = 0.0) -> bool:
        return seen(Feature(kind, pca, recovery_s, amplitude_l0, 1.0, 0.1), trials_at(6.2))

    assert of("isometric_force", 6.2)
    assert not of("isometric_force", 6.3)
    assert of("srs_conditioning", 6.2)
    assert of("srs_test", 6.2, 0.1, 0.0383)
    assert of("srs_test", 6.2, 0.001, 0.0)
    assert not of("srs_test", 6.2, 0.001, 0.0383)
    assert not of("srs_test", 6.2, 0.1, 0.0121)
    assert not of("srs_test", 4.5, 0.1, 0.0383)


@pytest.fixture(scope="module")
def real(shared_data: Path) -> FeatureTable:
    return read_features(shared_data / "empirical_srs.json", {A: trials_at(4.5, 6.1, 6.2), B: trials_at(6.2)})


def test_predictions_are_the_grids(real: FeatureTable) -> None:
    """Shared stretches and waits give what the paper's grid gives; a shift of the solution is another pCa."""
    fibre = load_fibre(A, "3state_coop")
    chosen = [f for f in real.cells[A] if f.pca == 6.2]
    found = simulated(Muscle(fibre), chosen, {6.2: 0.05})
    recoveries = sorted({f.recovery_s for f in chosen if f.kind == "srs_test"})
    amplitudes = sorted({f.amplitude_l0 for f in chosen if f.kind == "srs_test"})
    task = {
        "fibre": fibre_to_plain(fibre), "pca": 6.25, "recoveries_s": recoveries, "amplitudes_l0": amplitudes,
        "settle_s": None,
    }  # fmt: skip
    cells = grid.simulate(task)
    for f, value in zip(chosen, found, strict=True):
        expected = {
            "isometric_force": lambda: cells["isometric_f0"],
            "srs_conditioning": lambda: cells["srs_conditioning"],
            "srs_test": lambda f=f: cells["srs_test"][recoveries.index(f.recovery_s)][amplitudes.index(f.amplitude_l0)],
        }[f.kind]()
        assert value == pytest.approx(expected, rel=1e-3)
    assert np.max(np.abs(simulated(Muscle(fibre), chosen) - found)) > 0.5


def test_rmsd_is_that_of_evaluate(real: FeatureTable) -> None:
    values = {name: simulated(Muscle(load_fibre(name, "2state")), own) for name, own in real.cells.items()}
    model = as_table("2state", real.data, real.cells, values)
    whole = relative_srs_rmsd(model, real.data)
    for name, reading in READINGS.items():
        expected = score(model, real.data, reading, 8)
        assert {key: row.value for key, row in whole[name].items()} == expected.rmsd
        assert {key: row.n for key, row in whole[name].items()} == expected.conditions
    fitted = [Condition(0.0, 0.001), Condition(0.0383, 0.1)]
    concealed = relative_srs_rmsd(model, real.data, [c for c in CONDITIONS if c not in fitted])
    assert concealed["text"]["large"].n == 4
    assert concealed["released"]["large"].n == 8
    assert [row.value for row in relative_srs_rmsd(model, real.data, [])["text"].values()] == [None] * 3


def test_what_was_measured_predicts_itself(real: FeatureTable) -> None:
    values = {name: np.array([f.value for f in own]) for name, own in real.cells.items()}
    data = real.data.only(list(real.cells))
    same = as_table("same", data, real.cells, values)
    for name in real.cells:
        assert np.array_equal(same.fibres[name].test, data.fibres[name].test, equal_nan=True)
    assert max(r["all"].value or 0.0 for r in relative_srs_rmsd(same, data).values()) < 1e-12


def test_a_run_down_fibres_stretches_are_no_data(shared_data: Path) -> None:
    found = read_features(shared_data / "empirical_srs.json", {"13Dec2017a": trials_at(4.5, 6.3)})
    assert found.notes_of_fit[0].startswith("13Dec2017a: features ")
    assert "21 test stretches at pCa 4.5 are left out" in found.notes_of_fit[0]
    assert len(found.cells["13Dec2017a"]) == len(found.features["13Dec2017a"]) + 21
