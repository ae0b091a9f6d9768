"""Many fibres in lockstep, without ROS: each as in a node of its own."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from alone import Alone, batch_of, emitting
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from many_fibres import Answers, fibres, fragile

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.node.lockstep import Lockstep
from xb_muscle_ros.node.rules import Refusal
from xb_muscle_ros.node.status import Account

SECOND = 10**9
LENGTHS = st.one_of(st.floats(0.95, 1.05), st.sampled_from([math.nan, math.inf, 9.0]))
CALCIUM = st.floats(0.01, 30.0)
EVENTS = st.lists(
    st.tuples(
        st.sampled_from(["length", "length", "length", "calcium", "reset"]),
        st.sampled_from([-300, 0, 1, 1, 1, 2, 10]),
        st.sets(st.integers(0, 2), min_size=1),
        st.tuples(LENGTHS, LENGTHS, LENGTHS),
        st.tuples(CALCIUM, CALCIUM, CALCIUM),
    ),
    max_size=25,
)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(EVENTS, st.booleans())
def test_lockstep_is_that_of_single_fibres_to_the_bit(
    batch: MuscleBatch, notes: Any, events: list[Any], simulated: bool
) -> None:
    """Whatever messages name whom, and whatever is wrong with them: answers, refusals and accounts are the same."""
    answers, singly = Answers(), Answers()
    many = Lockstep(batch, answers.emit, notes, lambda: simulated)
    ones = []
    for i, muscle in enumerate(batch.muscles):

        def emit(stamp: int, out: Any, scale: Any, i: int = i) -> None:
            singly.rows[i].append((stamp, tuple(out), tuple(scale)))

        ones.append(Alone(Lockstep(batch_of(muscle), emitting(emit), notes, lambda: simulated)))
    now = SECOND
    for kind, ahead, whom, lengths, calcium in events:
        now += ahead * 1_000_000
        which = sorted(whom)
        refused: list[tuple[int, str]] = []
        found: list[Any] = []
        if kind == "reset":
            assert many.reset() == Account(
                *(sum(column) for column in zip(*(one.reset() for one in ones), strict=True))
            )
        elif kind == "calcium":
            found = many.take_calcium(now, fibres(*which), np.array([calcium[i] for i in which]))
            for i in which:
                try:
                    ones[i].take_calcium(now, calcium[i])
                except Refusal as refusal:
                    refused.append((i, str(refusal)))
        else:
            metres = {i: lengths[i] * 0.1 * (i + 1) for i in which}
            found = many.take_length(now, fibres(*which), np.array([metres[i] for i in which]), None)
            for i in which:
                try:
                    ones[i].take_length(now, metres[i], None)
                except (Refusal, UserError) as error:
                    refused.append((i, str(error)))
        assert sorted((t.fibre, str(t.error)) for t in found) == refused
    assert answers.rows == singly.rows
    assert all(math.isfinite(x) for rows in answers.rows.values() for _, out, _ in rows for x in out)


def test_a_message_for_all_is_answered_in_one(batch: MuscleBatch, notes: Any) -> None:
    """In the order of the fibres, also where the sender has another; one for some has an answer of some."""
    answers = Answers()
    many = Lockstep(batch, answers.emit, notes, lambda: False)
    many.take_calcium(0, fibres(0, 1, 2), np.array([5.0, 6.0, 7.0]))
    for k, order in enumerate([(0, 1, 2), (2, 0, 1), (1, 2, 0)]):
        many.take_length(k * 1_000_000, fibres(*order), np.array([0.1 * (i + 1) for i in order]), None)
    many.take_length(9_000_000, fibres(1), np.array([0.2]), None)
    assert [set(which) for _, which in answers.messages] == [{0, 1, 2}] * 3 + [{1}]
    assert many.status().ticks == 4
    assert many.reset() == Account(10, 3, 0)


def test_one_line_for_all_whose_time_went_back(batch: MuscleBatch, notes: Any) -> None:
    """With the names of some."""
    many = Lockstep(batch, Answers().emit, notes, lambda: True)
    for stamp in (5 * SECOND, 0):
        many.take_calcium(stamp, fibres(0, 1, 2), np.full(3, 5.0))
        many.take_length(stamp, fibres(0, 1, 2), np.array([0.1, 0.2, 0.3]), None)
    assert len(notes.lines) == 1
    assert notes.lines[0].startswith("warning left, right, back: length went back from 5.0")
    assert many.counts["time went back"] == 3


def test_snapshots_of_all_go_on_to_the_bit(batch: MuscleBatch, notes: Any) -> None:
    """And there are none while one fibre has no state."""
    whole, halves = Answers(), Answers()
    first = Lockstep(batch, whole.emit, notes, lambda: False)
    other = Lockstep(batch, halves.emit, notes, lambda: False)
    first.take_calcium(0, fibres(0, 1, 2), np.array([5.0, 6.0, 7.0]))
    first.take_length(0, fibres(0, 1), np.array([0.1, 0.2]), None)
    with pytest.raises(UserError, match="fibre back: there is no state to save yet"):
        first.save()
    for k in range(1, 10):
        first.take_length(k * 1_000_000, fibres(0, 1, 2), np.array([0.1, 0.2, 0.3]) * (1.0 + 1e-3 * k), None)
    other.load(first.save())
    for many in (first, other):
        for k in range(10, 20):
            many.take_length(k * 1_000_000, fibres(0, 1, 2), np.array([0.1, 0.2, 0.3]) * (1.0 + 1e-3 * k), None)
    for i in range(3):
        assert halves.rows[i] == whole.rows[i][-10:]


def test_a_fibre_that_fails_does_not_stop_the_others(batch: MuscleBatch, notes: Any) -> None:
    """It is named, refused from then on, and there again after a reset."""
    answers = Answers()
    many = Lockstep(fragile(batch, 1), answers.emit, notes, lambda: False)
    every, length = fibres(0, 1, 2), np.array([0.1, 0.2, 0.3])
    many.take_calcium(0, every, np.full(3, 5.0))
    assert many.take_length(0, every, length, None) == []
    trouble = many.take_length(1_000_000, every, length * np.array([1.0, 1.2, 1.0]), None)
    assert [(t.fibre, "state q2" in str(t.error)) for t in trouble] == [(1, True)]
    trouble = many.take_length(2_000_000, every, length, None)
    assert [(t.fibre, "call ~/reset" in str(t.error)) for t in trouble] == [(1, True)]
    assert [which for _, which in answers.messages] == [[0, 1, 2], [0, 2], [0, 2]]
    assert many.status().fault.startswith("1 of 3 fibres; right: fibre right: state q2")
    assert many.status().violations == 1
    many.reset()
    assert many.status().fault == ""
