"""What is assumed, left out or not looked at is said in one line each; nothing of it where it is not so."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import MappingProxyType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from made_trials import FIBRE, given_fibre

from xb_muscle_ros.diagnose import notes
from xb_muscle_ros.diagnose.effort import QUICK, Effort
from xb_muscle_ros.diagnose.names import MECHANISMS, Name
from xb_muscle_ros.fit.coordinates import Coordinate
from xb_muscle_ros.measurement.artefacts import ARTEFACTS
from xb_muscle_ros.scores.noise.model import Source
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.trial import Trial

TRIALS = [StretchShortenStretch(0.0383, 0.1).trial(FIBRE, pca) for pca in (4.5, 6.2, 9.0)]
INSIDE = Coordinate("f", None, True, 1.0, 1e4, 80.0, np.log(80.0), 1.0)
SHIFT = Coordinate("pca_shift", "pCa 6.2", False, -0.5, 0.5, 0.02, 0.0, 0.05)


def said(
    trials: Sequence[Trial] = TRIALS,
    noise: Sequence[tuple[Source, int]] = ((Source.WINDOW, 100),) * 3,
    coordinates: Sequence[Coordinate] = (INSIDE, SHIFT),
    fibre: Any = None,
    closure: float = 0.0,
) -> list[str]:
    of = [
        SimpleNamespace(trial=t.facts.trial, source=source, samples=samples)
        for t, (source, samples) in zip(trials, noise, strict=False)
    ]
    system: Any = SimpleNamespace(
        closure_f0={"a": np.array([closure])} if closure else {},
        error_sd=lambda name: ARTEFACTS[name].sd,
        problem=lambda names, values: SimpleNamespace(coordinates=tuple(coordinates)),
    )
    shown: Any = SimpleNamespace(names=(), values={})
    recordings: Any = SimpleNamespace(noise=SimpleNamespace(trials=of))
    return notes.of_fibre(given_fibre() if fibre is None else fibre, trials, recordings, system, shown)


def test_where_all_is_usual_nothing_is_said() -> None:
    assert said() == []
    assert notes.of_search([], []) == []
    assert notes.of_effort(Effort(), {"a": 3}) == []
    assert notes.of_order(["a"]) == []


STILL = [replace(t, length_m=np.full_like(t.length_m, t.facts.reference_length_m)) for t in TRIALS]
BARE = [replace(t, facts=replace(t.facts, phases=())) for t in TRIALS]
SAME = [replace(TRIALS[1], facts=replace(TRIALS[1].facts, trial=name)) for name in "abc"]
SMOOTH = replace(given_fibre(), values=MappingProxyType({**given_fibre().values, "smoothing": 100.0}))


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ({"trials": STILL}, "length never moves in these trials"),
        ({"trials": [STILL[0], *TRIALS[1:]]}, f"length never moves in trial {TRIALS[0].facts.trial}"),
        ({"trials": SAME}, "all trials are at one pCa"),
        ({"trials": BARE}, "no phases are known or found of trials"),
        ({"fibre": SMOOTH}, "smoothing of 100 was switched off"),
        ({"noise": [(Source.CURVE, 100)] * 3}, "noise was taken from the residual of smooth curves through force in"),
        ({"noise": [(Source.CURVE, 9)] * 3}, "noise is known from 27 samples only"),
        ({"noise": [(Source.DIFFERENCES, 90)] * 3}, "from what neighbouring samples do not predict of each other"),
        ({"noise": [(Source.WINDOW, 90), (Source.OTHERS, 0), (Source.WINDOW, 90)]}, "from the other trials in trial"),
        ({"closure": 0.004}, "the Gaussian form's own error, 0.40 % F0, was taken out"),
        ({"coordinates": [replace(INSIDE, start=1.0)]}, "ended at a bound: f at 1"),
        ({"coordinates": [replace(INSIDE, start=9999.0)]}, "ended at a bound: f at 1e+04"),
        ({"coordinates": [replace(SHIFT, start=-0.12)]}, "beyond 2 of their usual sizes: "),
    ],
)  # fmt: skip
def test_what_is_not_usual_is_said_in_one_line(given: dict[str, Any], line: str) -> None:
    found = said(**given)
    assert [text for text in found if line in text], found
    assert len(found) <= 2


def test_an_error_beyond_the_usual_is_told_with_its_solution_and_sizes() -> None:
    (line,) = said(coordinates=[replace(SHIFT, start=-0.12)])
    assert line.endswith("of pCa 6.2 -0.12 (ordinary: 0.05)")


def test_a_quick_look_and_too_few_trials_are_said() -> None:
    (quick,) = notes.of_effort(QUICK, {"a": 3})
    assert "at most 5 names in a set (else 6)" in quick
    assert "5 groups left out in turn (8), 200 repeats of the bootstrap (500)" in quick
    assert notes.of_effort(Effort(), {"a": 2}) == [
        "nothing could be left out of the fit: there are 2 trials, at least 3 are needed, so no mechanism is sure"
    ]
    assert notes.of_effort(Effort(), {"a": 7, "b": 1}) == [
        "nothing of fibre b could be left out of the fit: there is 1 trial, at least 3 are needed"
    ]


def test_the_order_that_run_down_counts_and_force_that_never_changes_are_said() -> None:
    assert notes.of_order(["b", "a"]) == ["run-down is counted in the order of the bags: trials b, a"]
    dead = replace(TRIALS[1], force_time_s=TRIALS[1].time_s, force_n=np.full(TRIALS[1].time_s.size, 0.5))
    (line,) = said(trials=[TRIALS[0], dead])
    assert line == (
        f"force is the same in every sample of trial {dead.facts.trial} though length moves: check the force channel"
    )


def test_what_could_not_be_tried_is_said_and_long_lists_are_cut() -> None:
    (line,) = notes.of_search([(Name.PHOSPHATE, Name.PCA_SHIFT)], [])
    assert line == "sets for which the model had no solution, not tried further: phosphate + pca_shift"
    (line,) = notes.of_search([(name,) for name in MECHANISMS[:9]], [])
    assert line.endswith(" and 3 more")
    (line,) = notes.of_search([], ["series_compliance"])
    assert line.endswith(": series_compliance")


def test_trials_that_stay_in_every_fit_are_told() -> None:
    trials: Any = [SimpleNamespace(name=name) for name in "abc"]
    assert notes.of_folds(trials, []) == []
    assert notes.of_folds(trials, [{"a", "b"}, {"c"}]) == []
    (line,) = notes.of_folds(trials, [{"a"}, {"c"}])
    assert line == "trial b stayed in every fit: pCa 4.5 defines F0, so nothing is predicted there"
