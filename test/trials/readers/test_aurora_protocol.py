"""Control functions of the 600A software, and the stretches they make."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from xb_muscle_ros.trials.readers.aurora_protocol import Option, Step, Stretches, in_words, stretches

UP, DOWN, AGAIN = (
    Step(0.4, "Length-Ramp", "+0.04 Lo 80 ms"),
    Step(0.48, "Length-Ramp", "-0.04 Lo 80 ms"),
    Step(0.66, "Length-Ramp", "+0.0383 Lo 80 ms"),
)


@pytest.mark.parametrize(
    ("line", "step"),
    [
        ("    400.0\tLength-Ramp\t\t+0.0400 Lo  80 ms", Step(0.4, "Length-Ramp", "+0.0400 Lo 80 ms")),
        ("0,5\tData-Enable\t\t", Step(0.0005, "Data-Enable", "")),
        (" 500.0 Bath  3 0 ms ", Step(0.5, "Bath", "3 0 ms")),
        ("Time (ms)\tControl Function\tOptions", None),
        ("", None),
        ("1.2.3\tStop", None),
    ],
)
def test_a_line_of_the_protocol(line: str, step: Step | None) -> None:
    assert Step.read(line) == step


def test_numbers_of_options() -> None:
    assert UP.numbers() == [Option("+", 0.04, "Lo"), Option("", 80.0, "ms")]
    assert Step(0.0, "Length-Ramp", "-0,5 mm  20 ms").numbers()[0] == Option("-", -0.5, "mm")
    assert Step(0.0, "Bath", "3 0 ms").numbers() == [Option("", 3.0, ""), Option("", 0.0, "ms")]


def test_the_paper_s_protocol_is_recognised() -> None:
    assert stretches([UP, DOWN, AGAIN], 0.0, 1.0) == Stretches(0.04, 0.1, 0.66)
    assert stretches([AGAIN], 0.0, 1.0) == Stretches(None, None, 0.66)
    in_mm = [step._replace(options=step.options.replace("Lo", "mm")) for step in (UP, DOWN, AGAIN)]
    assert stretches(in_mm, 0.0, 1.0) == Stretches(None, 0.1, 0.66)
    harmless = [Step(0.0, "Data-Enable", ""), Step(0.1, "Length-Sample", "1 50 ms"), Step(0.2, "Bath", "3 0 ms")]
    assert stretches([*harmless, UP, DOWN, AGAIN, Step(0.9, "Length-Ramp", "+0.0 Lo 5 ms")], 0.0, 1.0) is not None
    # What is outside of the record has no part in it.
    assert stretches([UP, DOWN, AGAIN], 0.6, 1.0) == Stretches(None, None, 0.66)


@pytest.mark.parametrize(
    "protocol",
    [
        [],
        [DOWN],
        [UP, DOWN],
        [UP, DOWN._replace(options="-0.03 Lo 80 ms"), AGAIN],
        [UP, DOWN._replace(options="-0.04 Lo 800 ms"), AGAIN],
        [UP, DOWN, AGAIN, Step(0.8, "Length-Step", "-0.2 Lo")],
        [UP, DOWN, AGAIN, Step(0.8, "Force-Clamp", "0.5 Fo 10 ms 10 ms")],
        [UP._replace(options="1.04 Lo 80 ms"), DOWN, AGAIN],
        [UP._replace(options="+0.04 Lo 80 s"), DOWN, AGAIN],
        [UP._replace(options=""), DOWN, AGAIN],
    ],
)
def test_anything_else_is_none(protocol: list[Step]) -> None:
    assert stretches(protocol, 0.0, 1.0) is None


def test_long_protocols_are_told_in_part() -> None:
    assert in_words([UP] * 12).count("Length-Ramp") == 12
    assert in_words([UP] * 950).endswith(", and 938 more")
    assert in_words([Step(0.0, "Stop", "")]) == "Stop at 0 s"


@given(st.text(), st.text())
def test_any_text_is_read_without_error(line: str, options: str) -> None:
    Step.read(line)
    stretches([Step(0.5, "Length-Ramp", options)], 0.0, 1.0)
