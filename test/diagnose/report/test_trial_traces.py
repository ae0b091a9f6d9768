"""``traces.npz``: what was written is read, and damage is named."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sample_diagnoses import five_fibres, nothing

from xb_muscle_ros.diagnose.report.traces import TrialTraces, read_traces, write_traces
from xb_muscle_ros.errors import UserError


def test_traces_come_back_as_they_were(tmp_path: Path) -> None:
    given = (*five_fibres().traces[:8], *nothing().traces[:1])
    write_traces(tmp_path / "traces.npz", given)
    found = read_traces(tmp_path / "traces.npz")
    assert [(t.fibre, t.trial) for t in found] == [(t.fibre, t.trial) for t in given]
    for one, other in zip(found, given, strict=True):
        for name in ("time_s", "length_l0", "measured_f0", "start_f0", "before_f0", "after_f0"):
            assert np.array_equal(getattr(one, name), getattr(other, name))
        assert (one.heldout_before_f0 is None) == (other.heldout_before_f0 is None)
        assert set(one.without_f0) == set(other.without_f0)
        for name in one.without_f0:
            assert np.array_equal(one.adds_f0(name), other.adds_f0(name))


def test_arrays_have_the_names_that_others_read(tmp_path: Path) -> None:
    write_traces(tmp_path / "traces.npz", five_fibres().traces[:1])
    with np.load(tmp_path / "traces.npz") as file:
        assert str(file["names"]) == '[{"fibre": "13Dec2017a", "trial": "13Dec2017a_pca66"}]'
        assert set(file.files) == {
            "names", "t0_time_s", "t0_length_l0", "t0_measured_f0", "t0_start_f0", "t0_before_f0", "t0_after_f0",
            "t0_heldout_before_f0", "t0_heldout_after_f0", "t0_without_forcible_detachment_f0",
            "t0_without_viscous_drag_f0", "t0_without_calcium_dependent_elasticity_f0",
        }  # fmt: skip


def test_any_name_of_a_component_is_kept(tmp_path: Path) -> None:
    trial = five_fibres().traces[0]
    names = ("a/b", "without_f0_f0", "λ m", "..")
    write_traces(tmp_path / "t.npz", [replace(trial, without_f0=dict.fromkeys(names, trial.after_f0))])
    assert tuple(read_traces(tmp_path / "t.npz")[0].without_f0) == names


def test_signals_of_another_length_are_refused() -> None:
    trial = five_fibres().traces[0]
    with pytest.raises(UserError, match=r"before_f0 has shape \(3,\), its time \(550,\)"):
        replace(trial, before_f0=np.zeros(3))
    with pytest.raises(UserError, match="without_viscous_drag_f0"):
        replace(trial, without_f0={"viscous_drag": np.zeros(3)})


def save(path: Path, **arrays: object) -> None:
    np.savez(path, **arrays)


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (lambda path: path.unlink(), "No such file"),
        (lambda path: path.write_bytes(b"PK no zip"), "cannot be read"),
        (lambda path: path.write_bytes(path.read_bytes()[:700]), "cannot be read"),
        (lambda path: save(path, t0_time_s=np.zeros(3)), "older version"),
        (lambda path: save(path, names="[{}]"), "cannot be read"),
        (lambda path: save(path, names='[{"fibre": "a", "trial": "b"}]'), r"no t0_time_s \(trial b\)"),
    ],
)  # fmt: skip
def test_damage_is_named(tmp_path: Path, damage: object, told: str) -> None:
    path = tmp_path / "traces.npz"
    write_traces(path, five_fibres().traces[:1])
    damage(path)
    with pytest.raises(UserError, match=told) as caught:
        read_traces(path)
    assert str(path) in str(caught.value)


def test_nothing_is_written_of_nothing_and_read(tmp_path: Path) -> None:
    write_traces(tmp_path / "t.npz", ())
    assert read_traces(tmp_path / "t.npz") == ()
    assert isinstance(five_fibres().traces[0], TrialTraces)
