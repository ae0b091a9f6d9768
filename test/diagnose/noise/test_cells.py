"""Trials cut into cells."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from xb_muscle_ros.diagnose.noise.cells import LEAST_SAMPLES, Residual, cut, exceeding, mean, phase_names, rms
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.trial import Phase

MS = 1e-3


def residual(phases: tuple[Phase, ...], n: int = 600, name: str = "a", first_s: float = 0.0) -> Residual:
    time_s = first_s + MS * np.arange(n)
    return Residual(name, 6.0, time_s, np.sin(time_s), phases, np.zeros(n), np.ones(n))


def test_phases_of_the_protocol() -> None:
    """Pauses above 0.2 s are cut after 0.1 s; a sample on a border belongs to what begins there."""
    protocol = StretchShortenStretch(0.0383, 0.5)
    cells = cut([residual(protocol.phases, 930)])
    assert [c.phase for c in cells] == [
        "isometric",
        "conditioning_stretch",
        "shortening",
        "recovery_early",
        "recovery_late",
        "test_stretch",
        "hold",
    ]
    assert cells[1].start_s == pytest.approx(0.1)
    assert cells[4].start_s - cells[3].start_s == pytest.approx(0.1)


def test_short_phases_go_to_the_one_before() -> None:
    """A recovery of 1 ms cannot be looked at by itself."""
    cells = cut([residual(StretchShortenStretch(0.0383, 0.001).phases, 430)])
    assert [c.phase for c in cells] == ["isometric", "conditioning_stretch", "shortening", "test_stretch", "hold"]


def test_window_of_a_fit_keeps_what_it_has_of_a_phase() -> None:
    """A fit's window begins late in the isometric phase; five samples of it go to the stretch."""
    cells = cut([residual(StretchShortenStretch(0.0383, 0.1).phases, 300, first_s=0.095)])
    assert cells[0].phase == "conditioning_stretch"
    assert cells[0].start_s == pytest.approx(0.095)


def test_phases_of_one_name_are_counted() -> None:
    phases = tuple(Phase("stretch", 0.1 * k, 0.1 * k + 0.1) for k in range(3))
    assert [c.phase for c in cut([residual(phases, 300)])] == ["stretch", "stretch_2", "stretch_3"]


def test_trial_without_phases_is_one_cell() -> None:
    (cell,) = cut([residual((), 50)])
    assert (cell.phase, cell.begin, cell.end) == ("whole", 0, 50)


def test_order_of_phases_agrees_with_every_trial() -> None:
    long, reference = StretchShortenStretch(0.0383, 0.5), StretchShortenStretch(0.0, 0.0, hold_s=0.4)
    names = phase_names(cut([residual(reference.phases, 580, "r"), residual(long.phases, 930)]))
    assert names.index("isometric") < names.index("shortening") < names.index("recovery_late")
    assert names.index("recovery_late") < names.index("test_stretch") < names.index("hold_early")


@given(
    st.lists(st.tuples(st.sampled_from(["stretch", "hold", "recovery"]), st.floats(0.0, 0.4)), max_size=6),
    st.integers(1, 700),
    st.floats(-0.2, 0.2),
)
def test_cells_hold_every_sample_once(parts: list[tuple[str, float]], n: int, first_s: float) -> None:
    phases, at = [], 0.0
    for name, duration in parts:
        phases.append(Phase(name, at, at + duration))
        at += duration
    both = [residual(tuple(phases), n, "a", first_s), residual(tuple(phases), 20, "b")]
    cells = cut(both)
    assert cells[0].begin == 0
    assert cells[-1].end == n + 20
    assert all(a.end == b.begin for a, b in itertools.pairwise(cells))
    assert all(c.end - c.begin >= LEAST_SAMPLES for c in cells if c.trial == "b" or n >= LEAST_SAMPLES)
    assert len({(c.trial, c.phase) for c in cells}) == len(cells)


def test_sizes_in_cells() -> None:
    both = [residual((), 10, "a"), residual((), 30, "b")]
    values = np.concatenate([np.full(10, -2.0), np.tile([1.0, 5.0], 15)])[:, None]
    cells = cut(both)
    assert rms(cells, values)[:, 0].tolist() == pytest.approx([2.0, np.sqrt(13.0)])
    assert mean(cells, values)[:, 0].tolist() == pytest.approx([-2.0, 3.0])


def test_span_of_a_bump() -> None:
    time_s = MS * np.arange(400)
    bump = np.where((time_s > 0.1) & (time_s < 0.2), -0.02, 0.0)
    start_s, end_s = exceeding(time_s, bump, 0.005)
    assert start_s == pytest.approx(0.1, abs=0.03)
    assert end_s == pytest.approx(0.2, abs=0.03)
    # Below the threshold everywhere: where it is at least half as large as it gets.
    assert exceeding(time_s, bump, 1.0)[0] > 0.08


@pytest.mark.parametrize(
    ("broken", "words"),
    [
        ([], "no trial to look for a mismatch in"),
        ([residual((), 9), residual((), 9)], "trial a is there 2 times"),
        ([residual((), 0)], "trial a: 0, 0, 0, 0 samples"),
        ([residual((), 9)._replace(length_l0=np.zeros(8))], "9, 9, 8, 9 samples"),
        ([residual((), 9)._replace(value_f0=np.full(9, np.inf))], "the residual is not finite"),
        ([residual((), 9)._replace(time_s=np.zeros(9))], "do not increase"),
    ],
)
def test_residuals_that_cannot_be(broken: list[Residual], words: str) -> None:
    with pytest.raises(UserError, match=words):
        cut(broken)
