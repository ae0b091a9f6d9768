"""Lines for a terminal: a table whose columns stand, with all that is named in it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from generated_diagnoses import diagnoses
from hypothesis import given, settings
from sample_diagnoses import ALL, five_fibres, one_fibre

from xb_muscle_ros.diagnose.component import NAMED
from xb_muscle_ros.diagnose.report import phrases as say
from xb_muscle_ros.diagnose.report.prose import headline, summary
from xb_muscle_ros.diagnose.report.terminal import terminal_text
from xb_muscle_ros.diagnose.result import Diagnosis


def table(text: str) -> list[str]:
    lines = text.split("\n")
    first = next(k for k, line in enumerate(lines) if line.startswith("component "))
    return lines[first : lines.index("", first) if "" in lines[first:] else len(lines)]


@pytest.mark.parametrize("name", ALL)
def test_headline_summary_and_table(name: str) -> None:
    d = ALL[name]().diagnosis
    text = terminal_text(d)
    flowing = " ".join(text.split())
    assert flowing.startswith(headline(d))
    assert " ".join(summary(d)) in flowing
    rows = table(text)
    starts = [0]
    for dashes in rows[1].split("  "):
        starts.append(starts[-1] + len(dashes) + 2)
    for row in rows[2:]:
        if " candidates shown" not in row:
            assert all(row[at - 2 : at].strip() == "" for at in starts[1:-1])
    for line in text.split("\n"):
        assert line in rows or len(line) <= 100
    for told in (*d.warnings, *d.missing, *d.notes):
        assert told in flowing


def test_a_row_has_all_that_is_known_of_a_component() -> None:
    rows = table(terminal_text(one_fibre().diagnosis))
    assert rows[0].split() == [
        "component", "probability", "ablation", "loss", "held-out", "gain", "±", "se", "parameter", "[95", "%]", "does",
    ]  # fmt: skip
    assert "> 0.99" in rows[2]
    assert "k 1040 1/s [870, 1230]" in rows[2]
    assert rows[2].endswith("lowers force late in fast stretch")
    assert rows[4].startswith("force drift (artefact)")
    assert rows[-1] == "7 of 10 candidates shown"


def test_parameters_at_a_bound_and_second_parameters_have_their_lines() -> None:
    d = one_fibre().diagnosis
    c = d.components[0]
    two = replace(c, parameters=(replace(c.parameters[0], at_bound=True), replace(c.parameters[0], name="x")))
    rows = table(terminal_text(replace(d, components=(two,))))
    assert "[870, 1230] at bound" in rows[2]
    assert rows[3].strip() == "x 1040 1/s [870, 1230]"


def test_long_names_take_two_lines() -> None:
    rows = table(terminal_text(five_fibres().diagnosis))
    assert rows[4].startswith("active titin or static ")
    assert rows[5].strip() == "calcium-dependent stiffness"


@settings(max_examples=40)
@given(diagnoses())
def test_whatever_is_named_has_a_row(d: Diagnosis) -> None:
    text = terminal_text(d)
    if not d.components:
        assert "candidates shown" not in text
        return
    rows = " ".join(" ".join(table(text)).split())
    for c in d.components:
        if c.inclusion_probability >= NAMED:
            assert say.title(c).split()[0] in rows
            assert say.probability(c.inclusion_probability) in rows
