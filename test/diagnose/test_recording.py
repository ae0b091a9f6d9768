"""What a record says beside the numbers: rivals by their components, beaten benchmarks, bags that were given twice."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from sample_diagnoses import one_fibre

from xb_muscle_ros.diagnose import intake, notes
from xb_muscle_ros.diagnose.component import Component, Kind
from xb_muscle_ros.diagnose.recording import _by_component


def component(name: str, *members: str, rivals: tuple[str, ...] = ()) -> Component:
    return Component(name, Kind.MECHANISM, "x", members or (name,), 0.5, not_separable_from=rivals)


def test_rivals_are_components_and_no_component_is_its_own() -> None:
    """A member of a family that is one component is not named beside it."""
    found = _by_component(
        [
            component("elasticity", "titin", "stiffness", rivals=("stiffness", "drag")),
            component("drag", rivals=("titin", "stiffness", "friction")),
            component("overlap"),
        ]
    )
    assert [c.not_separable_from for c in found] == [("drag",), ("elasticity", "friction"), ()]


def test_a_benchmark_that_the_base_beats_is_said() -> None:
    d = one_fibre().diagnosis
    base = d.before.heldout_rmsd_f0 or 0.0
    for benchmark, beaten in ((None, False), (0.5 * base, False), (1.5 * base, True)):
        changed = replace(d, benchmark_rmsd_f0=benchmark)
        assert changed.benchmark_is_beaten is beaten
        assert len(notes.of_benchmark(changed)) == beaten
    (line,) = notes.of_benchmark(replace(d, benchmark_rmsd_f0=1.5 * base))
    assert "is worse than the base model" in line
    nothing_held_out = replace(d, before=replace(d.before, heldout_rmsd_f0=None), benchmark_rmsd_f0=1.0)
    assert not nothing_held_out.benchmark_is_beaten


def test_bags_that_were_given_twice_are_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(intake, "find_bags", lambda paths: [b for p in paths for b in sorted(Path(p).glob("bag_*"))])
    for name in ("a/bag_1", "a/bag_2", "b/bag_3"):
        (tmp_path / name).mkdir(parents=True)
    a, b = tmp_path / "a", tmp_path / "b"
    assert intake.given_twice([a, b]) == []
    (line,) = intake.given_twice([a, b, tmp_path / "b" / ".." / "a"])
    assert line.startswith("bags that were given more than once are taken once: ")
    assert "bag_1" in line
    assert "bag_3" not in line
