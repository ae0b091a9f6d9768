"""Scores of composites: hand-made answers whose scores are known."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.diagnose.names import FAMILY, Name
from xb_muscle_ros.prove import calibration
from xb_muscle_ros.prove.answers import Answer
from xb_muscle_ros.prove.calibration import Stated, as_families, by_family, calibration_score, error, reliability
from xb_muscle_ros.prove.counting import Score, by_size, of_composites
from xb_muscle_ros.prove.judging import JudgedComposite, judge, judge_composite
from xb_muscle_ros.prove.make import seal
from xb_muscle_ros.prove.run import RESULTS
from xb_muscle_ros.prove.score import score
from xb_muscle_ros.prove.score_figures import ANSWERS, SILENT, TRUTHS, families
from xb_muscle_ros.prove.sealing import COMPOSITES, SINGLES

LENGTH = "length_dependence"


def truth(case: str, kind: str, effects: dict[str, float] | None = None, *artefacts: str) -> dict[str, Any]:
    """A case of a key; effects by label with their sizes, F0."""
    rows = [
        {
            "label": label, "family": None if label.startswith("outside:") else FAMILY[Name(label)],
            "unique_contribution_f0": size,
        }
        for label, size in (effects or {}).items()
    ]  # fmt: skip
    return {
        "case": case, "kind": kind, "trials": 7, "effects": rows, "artefacts": list(artefacts), "noise_rms_f0": 0.001,
    }  # fmt: skip


def said(verdict: str, stated: dict[str, float], **more: Any) -> dict[str, Any]:
    """A row of results: components by name with their probabilities; a family's name stands for its members."""
    rows = []
    for name, probability in sorted(stated.items(), key=lambda item: -item[1]):
        known = name in FAMILY
        family = FAMILY[Name(name)] if known else name
        members = [name] if known else [member for member in FAMILY if FAMILY[member] == name]
        artefact = Name(members[0]) in (Name.PCA_SHIFT, Name.FORCE_DRIFT, Name.FORCE_OFFSET, Name.RUN_DOWN)
        rows.append(
            {
                "name": name, "kind": "artefact" if artefact else "mechanism", "family": family, "members": members,
                "inclusion_probability": probability,
            }
        )  # fmt: skip
    answer = [r["name"] for r in rows if r["kind"] == "mechanism" and r["inclusion_probability"] >= 0.5]
    return {"verdict": verdict, "answer": answer, "components": rows, **more}


KEY = [
    truth("case_0001", "null"),
    truth("case_0002", "null"),
    truth("case_0003", "artefact", None, "force_drift", "pca_shift"),
    truth("case_0004", "artefact", None, "time_shift"),
    truth("case_0005", "composite", {"viscous_drag": 0.012, "lattice_spacing": 0.03}),
    truth("case_0006", "composite", {"active_titin": 0.02, "forcible_detachment": 0.006}),
    truth("case_0007", "composite", {"weakly_bound_heads": 0.015}),
    truth("case_0008", "outside", {"outside:series_creep": 0.02}),
    truth("case_0009", "outside", {"outside:series_creep": 0.02}),
    truth("case_0010", "outside", {"viscous_drag": 0.02, "outside:damage_by_stretch": 0.02}),
    truth("case_0011", "composite", {"viscous_drag": 0.02}),
]
SAID: dict[str, dict[str, Any]] = {
    "case_0001": said("none", {"viscous_drag": 0.05, "active_titin": 0.02}),
    "case_0002": said("ambiguous", {"viscous_drag": 0.55}),
    # An artefact of the other name, but of its family.
    "case_0003": said("measurement", {"force_offset": 0.9, "pca_shift": 0.3, "viscous_drag": 0.1}),
    "case_0004": said("physics", {"viscous_drag": 0.95}),
    # A family that cannot be resolved is found, but not by name.
    "case_0005": said(
        "physics", {"viscous_drag": 0.98, LENGTH: 0.9},
        before_heldout_f0=0.021, after_heldout_f0=0.003,
    ),
    # The other member of a right family; and a name of a family that is not there.
    "case_0006": said("physics", {"static_calcium_stiffness": 0.9, "weakly_bound_heads": 0.6}),
    "case_0007": said("ambiguous", {"weakly_bound_heads": 0.45, "active_titin": 0.35}),
    "case_0008": said("unexplained", {"viscous_drag": 0.2}),
    "case_0009": said("physics", {"half_sarcomere_spread": 0.92}),
    "case_0010": said("physics", {"viscous_drag": 0.99}),
}  # fmt: skip


def judged_all() -> list[JudgedComposite]:
    """All cases; the tool fails on the last."""
    return [judge_composite(case, Answer.read(SAID.get(case["case"], {"error": "no"}))) for case in KEY]


@pytest.fixture(scope="module")
def found() -> dict[str, Score]:
    """Scores by name."""
    judged = judged_all()
    return {s.name: s for s in of_composites(judged, calibration.of_composites(judged))}


def test_names_of_the_right_family(found: dict[str, Score]) -> None:
    # Named: drag, drag, drag and length (right), stiffness (right family), weak heads, spread, drag (right).
    assert (found["names_family"].value, found["names_family"].n) == (pytest.approx(4 / 8), 8)
    assert found["names_family"].reached is False
    # By name: drag twice.
    assert found["names_exact"].value == pytest.approx(2 / 8)


def test_effects_that_leave_one_per_cent_are_found(found: dict[str, Score]) -> None:
    # Drag, lattice, titin and drag beside the outside effect of six; forcible detachment is too small to count.
    assert (found["found_family"].value, found["found_family"].n) == (pytest.approx(4 / 6), 6)
    assert found["found_exact"].value == pytest.approx(2 / 6)
    assert (found["found_all"].value, found["found_all"].n) == (pytest.approx(4 / 7), 7)
    assert (found["found_of_1"].value, found["found_of_1"].n) == (0.0, 2)
    assert (found["found_of_2"].value, found["found_of_2"].n) == (1.0, 3)
    assert (found["found_beside_outside"].value, found["found_beside_outside"].n) == (1.0, 1)
    assert (found["complete"].value, found["complete"].n) == (pytest.approx(1 / 4), 4)
    assert (found["silent"].value, found["silent"].n) == (pytest.approx(2 / 4), 4)


def test_names_on_nulls_and_artefacts(found: dict[str, Score]) -> None:
    assert (found["null_named"].value, found["null_named"].n) == (0.5, 2)
    assert found["null_named"].reached is False
    assert (found["artefact_physics"].value, found["artefact_physics"].n) == (0.5, 2)
    assert (found["artefact_found"].value, found["artefact_found"].n) == (pytest.approx(1 / 3), 3)
    assert (found["artefact_names_family"].value, found["artefact_names_family"].n) == (1.0, 1)
    assert found["null_quiet"].value == 0.5


def test_a_mechanism_in_the_answer_of_an_artefact_is_physics_whatever_the_verdict() -> None:
    case = truth("x", "artefact", None, "time_shift")
    assert judge_composite(case, Answer.read(said("ambiguous", {"viscous_drag": 0.6}))).physics
    assert judge_composite(case, Answer.read({**said("physics", {}), "answer": []})).physics
    assert not judge_composite(case, Answer.read(said("ambiguous", {"viscous_drag": 0.4}))).physics


def test_outside_effects_are_not_named(found: dict[str, Score]) -> None:
    assert (found["outside_silent"].value, found["outside_silent"].n) == (pytest.approx(2 / 3), 3)
    assert (found["outside_alone_silent"].value, found["outside_alone_silent"].n) == (0.5, 2)
    assert (found["outside_beside_silent"].value, found["outside_beside_silent"].n) == (1.0, 1)


def test_calibration_error_by_hand(found: dict[str, Score]) -> None:
    # By bin of a tenth, wrong unless said: 0.0: .05 .02 | 0.1: .1 | 0.2: .2 | 0.3: .35 | 0.4: .45 right | 0.5: .55 |
    # 0.6: .6 | 0.9: .95 wrong, .98 .9 .9 .99 right, .92 wrong.
    by_bin = [0.07, 0.1, 0.2, 0.35, 1.0 - 0.45, 0.55, 0.6, abs(0.95 + 0.98 + 0.9 + 0.9 + 0.99 + 0.92 - 4.0)]
    assert found["calibration_components"].value == pytest.approx(sum(by_bin) / 14)
    # As stated the other member of a family is wrong, and a family of several is right as one.
    stated = [0.07, 0.1, 0.2, 0.35, 1.0 - 0.45, 0.55, 0.6, abs(0.95 + 0.98 + 0.9 + 0.9 + 0.99 + 0.92 - 3.0)]
    assert found["calibration"].value == pytest.approx(sum(stated) / 14)
    assert found["calibration"].n == 14
    assert found["calibration"].lower is not None
    assert found["calibration"].lower < found["calibration"].value < (found["calibration"].upper or 0.0)
    # By name the family is no statement, and the other member is wrong.
    wrong = [0.07, 0.1, 0.2, 0.35, 0.55, 0.55, 0.6, abs(0.95 + 0.98 + 0.9 + 0.99 + 0.92 - 2.0)]
    assert found["calibration_exact"].value == pytest.approx(sum(wrong) / 13)
    # Artefacts: offset .9 for drift is right by family, pCa .3 is right.
    assert found["calibration_artefacts"].value == pytest.approx((0.1 + 0.7) / 2)


def test_members_of_a_family_make_one_statement_of_it() -> None:
    """A small probability of the other member says nothing wrong of the family."""
    case = judge_composite(
        KEY[4], Answer.read(said("physics", {"lattice_spacing": 0.9, "filament_overlap": 0.2, "active_titin": 0.1}))
    )
    assert error([by_family(case.statements)]) == pytest.approx((0.1 + 0.8 + 0.1) / 3)
    assert as_families(case.statements) == [Stated(pytest.approx(0.92), True), Stated(pytest.approx(0.1), False)]


def test_edges_of_bins_and_nothing_stated() -> None:
    assert error([[Stated(1.0, True), Stated(0.95, True)]]) == pytest.approx(0.025)
    rows = reliability([[Stated(0.3, True), Stated(0.7, False), Stated(0.0, False)]])
    assert [row["from"] for row in rows] == [0.0, 0.3, 0.7]
    assert error([[], []]) is None
    assert calibration_score("x", "", [[]]).value is None


def test_calibrated_statements_have_little_error_and_overconfident_ones_much() -> None:
    random = np.random.default_rng(1)
    cases = []
    for _ in range(400):
        probability = random.uniform(0.0, 1.0, 10)
        cases.append([Stated(p, bool(random.random() < p)) for p in probability])
    calibrated = calibration_score("x", "", cases, 0.05)
    assert calibrated.reached
    assert calibrated.upper is not None
    assert calibrated.upper < 0.05
    bold = [[Stated(float(stated.probability > 0.5), stated.right) for stated in case] for case in cases]
    assert (error(bold) or 0.0) == pytest.approx(0.25, abs=0.03)


def test_bootstrap_is_over_cases_not_statements() -> None:
    # The same statement many times in a case tells no more than once.
    alone = [[Stated(0.5, bool(i % 2))] for i in range(40)]
    often = [case * 10 for case in alone]
    first, second = calibration_score("x", "", alone), calibration_score("x", "", often)
    assert (second.lower, second.upper) == (pytest.approx(first.lower), pytest.approx(first.upper))
    assert second.n == 10 * first.n


def test_intervals_of_shares_are_exact(found: dict[str, Score]) -> None:
    assert found["null_named"].lower == pytest.approx(0.0126, abs=1e-4)
    assert found["null_named"].upper == pytest.approx(0.9874, abs=1e-4)


def test_failure_names_nothing_and_finds_nothing(found: dict[str, Score]) -> None:
    assert found["failed"].value == pytest.approx(1 / 11)
    last = judged_all()[-1]
    assert (last.verdict, last.named, last.effects[0].family_found) == ("error", (), False)


def test_gain_is_of_what_the_true_model_gains(found: dict[str, Score]) -> None:
    assert (found["gain"].value, found["gain"].n) == (pytest.approx(0.9), 1)


def test_answers_of_the_first_format_count_by_their_names() -> None:
    case = judge_composite(KEY[4], Answer.read({"verdict": "physics", "answer": ["viscous_drag", "force_offset"]}))
    assert [name.name for name in case.named] == ["viscous_drag"]
    assert [name.name for name in case.artefacts_named] == ["force_offset"]
    assert case.statements == ()
    assert by_family(case.statements) == []


def test_second_format_in_a_benchmark_of_single_effects() -> None:
    single = {
        "case": "x", "kind": "single", "labels": ["lattice_spacing"], "size_f0": 0.02, "size_class_f0": 0.02,
        "noise_rms_f0": 0.001, "cells": [],
    }  # fmt: skip
    by_name = judge(single, Answer.read(said("physics", {"lattice_spacing": 0.95})))
    assert (by_name.exact, by_name.family, by_name.confidence) == (True, True, 0.95)
    as_family = judge(single, Answer.read(said("physics", {LENGTH: 0.95})))
    assert (as_family.exact, as_family.family, as_family.answer) == (False, True, LENGTH)
    other = judge(single, Answer.read(said("physics", {"viscous_drag": 0.95, "lattice_spacing": 0.6})))
    assert (other.exact, other.family, other.answer) == (False, False, "viscous_drag")
    artefact = {**single, "kind": "artefact", "labels": ["force_drift"]}
    blamed = judge(artefact, Answer.read(said("measurement", {"force_drift": 0.8, "viscous_drag": 0.1})))
    assert (blamed.exact, blamed.physics, blamed.answer) == (True, False, "force_drift")
    assert judge(artefact, Answer.read(said("ambiguous", {"viscous_drag": 0.6}))).physics


def test_sizes_have_their_classes() -> None:
    effects = [effect for j in judged_all() for effect in j.effects]
    rows = by_size(effects, lambda e: e.size_f0, {"family": lambda e: e.family_found})
    assert [(row["from_f0"], row["n"]) for row in rows] == [(0.0, 0), (0.005, 1), (0.01, 2), (0.02, 4), (0.04, 0)]
    assert rows[3]["family"]["value"] == pytest.approx(3 / 4)


def test_confusion_counts_every_effect_once() -> None:
    judged = judged_all()
    counts = families(judged)
    effects = [effect.family for j in judged for effect in j.effects]
    for family in set(effects):
        row = counts[TRUTHS.index(family)]
        assert row[ANSWERS.index(family)] + row[ANSWERS.index(SILENT)] == effects.count(family)
    # The weak heads of case 6 stand where its forcible detachment was missed.
    assert counts[TRUTHS.index("heads_under_strain"), ANSWERS.index("weak_binding")] == 1.0


def test_scored_with_figures_and_never_as_single_effects(tmp_path: Path) -> None:
    seal(tmp_path / "r", tmp_path / "key.json", 3, KEY, "about", "gaussian", COMPOSITES)
    results = {case["case"]: SAID.get(case["case"], SAID["case_0001"]) for case in KEY}
    (tmp_path / "r" / RESULTS).write_text(json.dumps({"cases": results}))
    text, files = score(tmp_path / "r", tmp_path / "key.json", tmp_path / "s")
    assert "| nulls with any mechanism named | 50 % | 1 % to 99 % | 2 | ≤ 2 % | no |" in " ".join(text.split())
    assert "| expected calibration error of inclusion probabilities, as stated | 0." in " ".join(text.split())
    assert {path.name for path in files} == {
        "scores.json", "scores.md", "found_by_size.png", "families.png", "calibration.png",
    }  # fmt: skip
    assert all(path.stat().st_size for path in files)
    tree = json.loads((tmp_path / "s" / "scores.json").read_text())
    assert tree["judged"][4]["effects"][1] == {
        "label": "lattice_spacing", "family": LENGTH, "size_f0": 0.03, "family_found": True, "exact_found": False,
    }  # fmt: skip
    seal(tmp_path / "r", tmp_path / "key.json", 3, [], "about", "gaussian", SINGLES)
    assert json.loads((tmp_path / "key.json").read_text())["kind"] == SINGLES
