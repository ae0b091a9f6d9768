"""What is assumed, left out or not looked at is said, in summary and JSON; nothing of it where it is not so."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import MappingProxyType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.diagnose.notes import notes, of_effort
from xb_muscle_ros.diagnose.search import QUICK, Effort
from xb_muscle_ros.diagnose.summary import summary_text
from xb_muscle_ros.fit.coordinates import Coordinate
from xb_muscle_ros.models.fibre_file import changed, load_fibre
from xb_muscle_ros.scores.noise.model import Source
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.trial import Trial

FIBRE = changed(load_fibre("18Dec2017a"), {"smoothing": 0.0}, "test")
TRIALS = [StretchShortenStretch(0.0383, 0.1).trial("18Dec2017a", pca) for pca in (4.5, 6.2, 9.0)]
INSIDE = Coordinate("f", None, True, 1.0, 1e4, 80.0, np.log(80.0), 1.0)
SHIFT = Coordinate("pca_shift", "pCa 6.2", False, -0.5, 0.5, 0.02, 0.0, 0.05)


def said(
    trials: Sequence[Trial] = TRIALS,
    noise: Sequence[tuple[Source, int]] = ((Source.WINDOW, 100),) * 3,
    coordinates: Sequence[Coordinate] = (INSIDE, SHIFT),
    fibre: Any = FIBRE,
    closure: float = 0.0,
    unsolved: Sequence[str] = (),
) -> list[str]:
    of = [
        SimpleNamespace(trial=t.facts.trial, source=source, samples=samples)
        for t, (source, samples) in zip(trials, noise, strict=False)
    ]
    study = SimpleNamespace(fibre=FIBRE, closure_f0={"a": np.array([closure])} if closure else {})
    search: Any = SimpleNamespace(study=study, unsolved=list(unsolved))
    shown: Any = SimpleNamespace(problem=lambda _: SimpleNamespace(coordinates=tuple(coordinates)))
    recordings: Any = SimpleNamespace(noise=SimpleNamespace(trials=of))
    return notes(fibre, trials, recordings, search, shown)


def test_where_all_is_usual_only_the_candidates_that_cannot_be_are_named() -> None:
    (line,) = said()
    assert line.startswith("not tried, as model 3state_coop has them already")
    assert "thin-filament cooperativity" in line


STILL = [replace(t, length_m=np.full_like(t.length_m, t.facts.reference_length_m)) for t in TRIALS]
BARE = [replace(t, facts=replace(t.facts, phases=())) for t in TRIALS]
SAME = [replace(TRIALS[1], facts=replace(TRIALS[1].facts, trial=name)) for name in "abc"]
SMOOTH = replace(FIBRE, values=MappingProxyType({**FIBRE.values, "smoothing": 100.0}))


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ({"trials": STILL}, "length never changes in these trials"),
        ({"trials": [STILL[0], *TRIALS[1:]]}, f"length never changes in {TRIALS[0].facts.trial}"),
        ({"trials": SAME}, "all trials are at pCa 6.2"),
        ({"trials": BARE}, "no phases are known of"),
        ({"fibre": SMOOTH}, "smoothing of 100 was switched off"),
        ({"noise": [(Source.CURVE, 100)] * 3}, "was taken from what smooth curves leave"),
        ({"noise": [(Source.CURVE, 9)] * 3}, "the noise is known from 27 samples of force in all"),
        ({"noise": [(Source.DIFFERENCES, 90)] * 3}, "differences of neighbouring samples"),
        ({"noise": [(Source.WINDOW, 90), (Source.OTHERS, 0), (Source.WINDOW, 90)]}, "like that of the other trials"),
        ({"closure": 0.004}, "the Gaussian form of the heads' strain was taken out of every model, up to 0.4 %"),
        ({"coordinates": [replace(INSIDE, start=1.0)]}, "ended at a bound of f"),
        ({"coordinates": [replace(INSIDE, start=9999.0)]}, "ended at a bound of f"),
        ({"coordinates": [replace(SHIFT, start=-0.12)]}, "by twice or more: pca_shift of pCa 6.2"),
        ({"unsolved": ["phosphate"]}, "no solution was found with phosphate"),
    ],
)  # fmt: skip
def test_what_is_not_usual_is_said_in_one_line(given: dict[str, Any], line: str) -> None:
    found = said(**given)
    assert [text for text in found if line in text], found
    assert len(found) - len(said()) <= 2
    assert line in summary_text({"verdict": "none", "notes": found})


def test_a_quick_look_and_too_few_trials_are_said() -> None:
    assert of_effort(Effort(), Effort(), 3) == []
    (quick,) = of_effort(QUICK, Effort(), 3)
    assert "at most 2 explanations together (else 3)" in quick
    assert "nothing could be left out of the fit: there are 2 trials" in of_effort(Effort(), Effort(), 2)[0]
    assert "there is 1 trial" in of_effort(Effort(), Effort(), 1)[0]
