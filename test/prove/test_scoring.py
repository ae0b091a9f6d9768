"""Scores: hand-made results whose scores are known, and a key that must be the sealed one."""

from __future__ import annotations

import json
import sys
import types
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from sample_diagnoses import nothing

from xb_muscle_ros.cli.main import main
from xb_muscle_ros.diagnose import intake, outputs
from xb_muscle_ros.diagnose.component import Component, Kind
from xb_muscle_ros.diagnose.names import FAMILY, MEASUREMENT, Name
from xb_muscle_ros.diagnose.residual import Place
from xb_muscle_ros.diagnose.result import Diagnosis, Verdict
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.prove.answers import Answer
from xb_muscle_ros.prove.counting import interval, of_singles
from xb_muscle_ros.prove.judging import judge
from xb_muscle_ros.prove.make import seal
from xb_muscle_ros.prove.run import RESULTS, run
from xb_muscle_ros.prove.score import score
from xb_muscle_ros.prove.score_figures import confusion
from xb_muscle_ros.prove.sealing import KINDS, digest, load_benchmark
from xb_muscle_ros.work import Options

CELLS = [
    {"trial": "trial_01", "phase": "hold", "rms_f0": 0.010, "beside_nuisances_f0": 0.002},
    {"trial": "trial_01", "phase": "recovery", "rms_f0": 0.006, "beside_nuisances_f0": 0.004},
    {"trial": "trial_02", "phase": "hold", "rms_f0": 0.004, "beside_nuisances_f0": 0.001},
]


def truth(case: str, kind: str, *labels: str, size: float | None = None) -> dict[str, Any]:
    """A case of a key."""
    cells = CELLS if size else [{**cell, "rms_f0": 0.0, "beside_nuisances_f0": 0.0} for cell in CELLS]
    return {
        "case": case, "kind": kind, "labels": list(labels), "size_f0": size or 0.0, "size_class_f0": size,
        "noise_rms_f0": 0.001, "cells": cells,
    }  # fmt: skip


def said(verdict: str, *answer: str, where: tuple[str, str] | None = None, **more: Any) -> dict[str, Any]:
    """What a tool says of a case."""
    first = None if where is None else {"trial": where[0], "phase": where[1], "size_f0": 0.01}
    return {"verdict": verdict, "answer": list(answer), "first_mismatch": first, "confidence": 0.8, **more}


KEY = [
    truth("case_0001", "null"),
    truth("case_0002", "null"),
    truth("case_0003", "artefact", "force_drift"),
    truth("case_0004", "artefact", "time_shift"),
    truth("case_0005", "single", "viscous_drag", size=0.02),
    truth("case_0006", "single", "lattice_spacing", size=0.04),
    truth("case_0007", "single", "active_titin", size=0.005),
    truth("case_0008", "pair", "forcible_detachment", "active_titin", size=0.02),
    truth("case_0009", "outside", "outside:series_creep", size=0.01),
    truth("case_0010", "single", "temperature", size=0.0),
]
SAID = {
    "case_0001": said("none"),
    "case_0002": said("ambiguous", "viscous_drag", "force_offset"),
    "case_0003": said("measurement", "force_offset"),
    "case_0004": said("physics", "viscous_drag"),
    "case_0005": said(
        "physics", "viscous_drag", where=("trial_01", "hold"), before_heldout_f0=0.021, after_heldout_f0=0.003
    ),
    "case_0006": said("ambiguous", "filament_overlap", where=("trial_01", "recovery")),
    "case_0007": said("unexplained", where=("trial_02", "hold")),
    "case_0008": said("physics", "active_titin", where=("trial_01", "hold")),
    "case_0009": said("unexplained"),
    "case_0010": said("parameters"),
}


def test_scores_of_known_results() -> None:
    judged = [judge(case, Answer.read(SAID[case["case"]])) for case in KEY]
    found = {s.name: s for s in of_singles(judged)}
    expected = {
        "null_physics": (0.5, 2), "artefact_physics": (0.5, 2), "large_family": (1.0, 2), "large_exact": (0.5, 2),
        "precision_family": (2 / 3, 3), "precision_exact": (2 / 3, 3), "outside_abstains": (1.0, 1),
        "located": (0.75, 4), "located_beside_nuisances": (0.75, 4), "gain": (0.9, 1), "coverage": (0.4, 5),
        "artefact_exact": (0.0, 2), "artefact_family": (0.5, 2), "null_quiet": (0.5, 2), "pair_first": (1.0, 1),
        "mismatch_found": (2 / 3, 6), "worse": (0.0, 1), "failed": (0.0, 10),
    }  # fmt: skip
    for name, (value, n) in expected.items():
        assert (found[name].value, found[name].n) == (pytest.approx(value), n), name
    assert found["null_physics"].reached is False
    assert found["large_family"].reached is True
    assert judged[-1].exact


def test_failure_of_the_tool_is_no_right_answer() -> None:
    judged = judge(KEY[4], Answer.read({"error": "no such bag"}))
    assert (judged.verdict, judged.exact, judged.family, judged.located) == ("error", False, False, None)


def test_untouched_recordings_have_no_truth_to_confuse() -> None:
    judged = [
        judge(truth("case_0001", "untouched"), Answer.read(said("unexplained"))),
        judge(KEY[4], Answer.read(SAID["case_0005"])),
    ]
    assert confusion(judged).sum() == 1.0


def test_interval_is_exact() -> None:
    # Published values of the Clopper–Pearson interval.
    assert interval(0, 10) == (0.0, pytest.approx(0.3085, abs=1e-4))
    assert interval(5, 10) == (pytest.approx(0.1871, abs=1e-4), pytest.approx(0.8129, abs=1e-4))


@pytest.fixture
def benchmark_folder(tmp_path: Path) -> Path:
    """A sealed benchmark whose cases are empty files."""
    seal(tmp_path / "b", tmp_path / "key.json", 3, KEY, "about", "gaussian")
    for case in SAID:
        (tmp_path / "b" / "cases" / case / "bags").mkdir(parents=True)
        (tmp_path / "b" / "cases" / case / "fibre.yaml").write_text(case)
    return tmp_path


def diagnosed(found: dict[str, Any]) -> Diagnosis:
    """The record of what a tool says."""
    plain, first = nothing().diagnosis, found["first_mismatch"]
    named = [Name(name) for name in found["answer"]]
    components = tuple(
        Component(n, Kind.ARTEFACT if n in MEASUREMENT else Kind.MECHANISM, FAMILY[n], (n,), 0.8) for n in named
    )
    held = {
        when: replace(getattr(plain, when), heldout_rmsd_f0=found.get(f"{when}_heldout_f0"))
        for when in ("before", "after")
    }
    place = first and Place("f", first["trial"], first["phase"], 0.1, 0.2, first["size_f0"], 0.01, 0.01)
    return replace(
        plain,
        verdict=Verdict(found["verdict"]),
        answer=tuple(n for n in named if n not in MEASUREMENT),
        components=components,
        mismatch=(place,) if place else (),
        **held,
    )


def _tool(monkeypatch: pytest.MonkeyPatch, seen: list[str]) -> None:
    """A stand-in for the tool that knows the answers of `SAID`; its studies are names of cases."""

    def diagnose(studies: str, quick: bool, seed: int, options: Options) -> tuple[Diagnosis, None]:
        seen.append(studies)
        if studies == "case_0010":
            raise UserError("no force")
        return diagnosed(SAID[studies]), None

    module = types.ModuleType("xb_muscle_ros.diagnose.run")
    module.diagnose = diagnose
    monkeypatch.setitem(sys.modules, "xb_muscle_ros.diagnose.run", module)
    monkeypatch.setattr(intake, "read_fibres", lambda bags, fibers: fibers[0].parent.name)
    monkeypatch.setattr(outputs, "write", lambda out, found, files, report: None)


def test_run_then_score(benchmark_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[str] = []
    _tool(monkeypatch, seen)
    out = benchmark_folder / "r"
    done = run(benchmark_folder / "b", out, True, 1, Options(processes=0, quiet=True))
    assert done["cases"]["case_0010"]["error"] == "no force"
    with pytest.raises(UserError, match=r"results\.json exists; use --overwrite"):
        run(benchmark_folder / "b", out, True, 1, Options(processes=0, quiet=True))
    again = run(benchmark_folder / "b", out, True, 1, Options(processes=0, quiet=True), overwrite=True)
    assert seen == sorted(SAID)
    assert again == done
    text, files = score(out, benchmark_folder / "key.json", benchmark_folder / "s")
    assert "| false alarm on nulls | 50 % | 1 % to 99 % | 2 | ≤ 5 % | no |" in " ".join(text.split())
    assert all(path.stat().st_size for path in files)
    tree = json.loads((benchmark_folder / "s" / "scores.json").read_text())
    assert tree["scores"]["gain"]["value"] == pytest.approx(0.9)
    assert tree["scores"]["failed"]["value"] == pytest.approx(0.1)


def test_an_answer_worse_than_the_base_is_counted() -> None:
    rows = [said("physics", "viscous_drag", before_heldout_f0=0.02, after_heldout_f0=after) for after in (0.03, 0.01)]
    found = {s.name: s for s in of_singles([judge(KEY[4], Answer.read(row)) for row in rows])}
    assert (found["worse"].value, found["worse"].n) == (0.5, 2)


@pytest.mark.parametrize("run", ["release_1", "release_2", "release_3", "release_4", "composites_1"])
def test_results_of_published_runs_are_read(run: str) -> None:
    folder = Path(__file__).parents[2] / "docs" / "benchmark" / run
    rows = json.loads((folder / RESULTS).read_text(encoding="utf-8"))["cases"]
    verdicts = {*(verdict.value for verdict in Verdict), "error"}
    for row in rows.values():
        found = Answer.read(row)
        assert found.verdict in verdicts
        assert found.names == tuple(row.get("answer", ()))
        assert (found.mechanisms is None) == ("components" not in row)
        assert {s.name for s in found.named_mechanisms} <= set(found.names)
    assert load_benchmark(folder)["cases"] == sorted(rows)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_key_of_the_former_version_is_scored(kind: str, tmp_path: Path) -> None:
    """`key_2.json`: open cases, results and scores by the version that wrote keys of version 2."""
    held = json.loads((Path(__file__).parent / "key_2.json").read_text(encoding="utf-8"))[kind]
    key = tmp_path / "key.json"
    key.write_text(json.dumps(held["key"]))
    cases = [case["case"] for case in held["key"]["cases"]]
    benchmark = {"version": 2, "kind": kind, "cases": cases, "key_sha256": digest(key)}
    (tmp_path / "r").mkdir()
    (tmp_path / "r" / "benchmark.json").write_text(json.dumps(benchmark))
    (tmp_path / "r" / RESULTS).write_text(json.dumps({"cases": held["results"]}))
    score(tmp_path / "r", key, tmp_path / "s")
    found = json.loads((tmp_path / "s" / "scores.json").read_text())["scores"]
    assert {name: found[name]["value"] for name in held["scores"]} == pytest.approx(held["scores"])


def test_another_key_is_refused(benchmark_folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = benchmark_folder / "r"
    out.mkdir()
    (out / RESULTS).write_text(json.dumps({"cases": SAID}))
    (out / "benchmark.json").write_text((benchmark_folder / "b" / "benchmark.json").read_text())
    key = benchmark_folder / "key.json"
    arguments = ["prove", "score", str(out), "--key", str(key), "--out", str(benchmark_folder / "s")]
    assert main(arguments) == 0
    content = json.loads(key.read_text())
    content["cases"][0]["kind"] = "single"
    key.write_text(json.dumps(content))
    assert main(arguments) == 2
    assert "exists; use --overwrite" in capsys.readouterr().err
    assert main([*arguments, "--overwrite"]) == 2
    assert "sealed with" in capsys.readouterr().err


def test_unfinished_results_are_refused(benchmark_folder: Path) -> None:
    out = benchmark_folder / "r"
    out.mkdir()
    (out / RESULTS).write_text(json.dumps({"cases": {"case_0001": SAID["case_0001"]}}))
    (out / "benchmark.json").write_text((benchmark_folder / "b" / "benchmark.json").read_text())
    with pytest.raises(UserError, match="lacks 9 of 10 cases, case_0002 first"):
        score(out, benchmark_folder / "key.json", benchmark_folder / "s")
