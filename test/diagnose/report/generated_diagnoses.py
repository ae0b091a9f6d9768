"""Records of every shape that the types allow: what a diagnosis says must hold for all of them."""

from __future__ import annotations

import math
from typing import Any

from hypothesis import strategies as st

from xb_muscle_ros.diagnose.component import NAMED, Component, HeldOutGain, Kind, OfFibre, Parameter
from xb_muscle_ros.diagnose.names import FAMILY, MEASUREMENT, MECHANISMS
from xb_muscle_ros.diagnose.residual import AnswerResidual, Place, ResidualLaw, ResidualMap
from xb_muscle_ros.diagnose.result import (
    FORMAT,
    Diagnosis,
    Feature,
    FeatureScore,
    NextExperiment,
    NuisanceParameter,
    OfStudyFibre,
    OfTrial,
    Scores,
    SetOfMechanisms,
    Verdict,
)

WORDS = st.text(st.characters(exclude_categories=("Cs",), exclude_characters="."), min_size=1, max_size=12)
NUMBERS = st.floats(-1e6, 1e6, allow_nan=False)
SHARES = st.floats(0.0, 1.0)
FORCES = st.floats(1e-5, 2.0)
PHASES = ("isometric", "conditioning_stretch", "hold", "recovery")


def unknown(values: st.SearchStrategy[float]) -> st.SearchStrategy[float]:
    """With NaN among them."""
    return st.one_of(values, st.just(math.nan))


def few(of: st.SearchStrategy[Any], most: int = 3) -> st.SearchStrategy[tuple[Any, ...]]:
    return st.lists(of, max_size=most).map(tuple)


def optional(of: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    return st.one_of(st.none(), of)


@st.composite
def diagnoses(draw: Any, holes: bool = True) -> Diagnosis:
    """A record; with `holes` any number that is not a probability may be NaN."""
    plain = unknown(NUMBERS) if holes else NUMBERS
    force = unknown(FORCES) if holes else FORCES
    share = unknown(st.floats(-1.5, 1.5)) if holes else st.floats(-1.5, 1.5)
    fibres = tuple(f"fibre_{k}" for k in range(draw(st.integers(1, 3))))
    trials = [(f, f"{f}_trial_{k}") for f in fibres for k in range(draw(st.integers(1, 3)))]
    gains = st.builds(HeldOutGain, plain, plain, st.just("log RMSD ratio"), st.integers(1, 9), force, force)
    pairs = st.tuples(plain, plain)
    parameters = st.builds(Parameter, WORDS, st.sampled_from(["1", "1/s", "F0/L0"]), plain, pairs, st.booleans(),
                           optional(plain))  # fmt: skip

    def component(names: tuple[Any, ...], kind: Kind) -> Component:
        members = tuple(names)
        family = str(FAMILY[names[0]])
        rows = tuple(
            OfFibre(f, draw(SHARES), draw(share), draw(optional(gains)), draw(few(parameters, 1))) for f in fibres
        )
        return Component(
            family if len(members) > 1 else members[0], kind, family, members, draw(SHARES), draw(share),
            draw(optional(gains)), draw(few(parameters, 2)), draw(WORDS), (), rows,
        )  # fmt: skip

    mechanisms = draw(st.lists(st.sampled_from(MECHANISMS), unique=True, max_size=6))
    errors = draw(st.lists(st.sampled_from(MEASUREMENT), unique=True, max_size=3))
    together = draw(st.integers(0, len(mechanisms)))
    groups = ([tuple(mechanisms[:together])] if together else []) + [(name,) for name in mechanisms[together:]]
    parts = [component(names, Kind.MECHANISM) for names in groups]
    parts += [component((name,), Kind.ARTEFACT) for name in errors]
    parts.sort(key=lambda c: -c.inclusion_probability)

    def places() -> tuple[Place, ...]:
        made = st.builds(
            lambda of, phase, size, mean, pca: Place(*of, phase, 0.1, 0.2, size, mean, 0.01, pca),
            st.sampled_from(trials), st.sampled_from(PHASES), force, plain, optional(st.floats(4.5, 9.0)),
        )  # fmt: skip
        return draw(few(made))

    laws = st.builds(
        ResidualLaw, st.sampled_from(fibres), unknown(st.floats(1e-3, 5.0)) if holes else st.floats(1e-3, 5.0),
        st.sampled_from(["constant", "activation", "calcium", "force"]), plain, share, few(FORCES), few(plain),
        st.dictionaries(st.sampled_from(["constant", "force"]), share),
    )  # fmt: skip
    names = [c.name for c in parts]
    sets = few(st.sampled_from(names), 2) if names else st.just(())
    scores = st.builds(Scores, sets, force, optional(force))
    rows = tuple(
        OfTrial(
            *of, draw(optional(st.floats(4.5, 9.0))), (("hold", 0.0, 0.2),), draw(force), "window", 9, draw(force),
            draw(force), *draw(st.one_of(st.just((None, None)), st.tuples(force, force))),
        )
        for of in trials
    )  # fmt: skip
    base = st.tuples(WORDS, plain, plain, st.sampled_from(["1", "1/s"]))
    study = tuple(
        OfStudyFibre(
            f, "3state_coop", 2, draw(sets), draw(scores), draw(scores), draw(optional(st.tuples(force, force))),
            draw(SHARES), draw(few(base)), 0.0,
        )
        for f in fibres
    )  # fmt: skip
    grid = draw(st.lists(st.one_of(st.none(), FORCES), min_size=len(PHASES), max_size=len(PHASES)))
    holes_of = tuple(grid)
    maps = {
        fibres[0]: ResidualMap(
            (trials[0][1],), tuple(PHASES), (holes_of,), (holes_of,), (holes_of,), ((False,) * len(PHASES),)
        )
    }
    return Diagnosis(
        FORMAT, fibres, "3state_coop", "gaussian", draw(st.booleans()), 1, 2.5, draw(st.sampled_from(Verdict)),
        tuple(c.name for c in parts if c.kind is Kind.MECHANISM and c.inclusion_probability >= NAMED), tuple(parts),
        draw(share), places(), draw(SHARES), draw(st.booleans()),
        AnswerResidual(draw(force), draw(force), places(), draw(optional(laws))), draw(optional(laws)), draw(scores),
        draw(scores), draw(optional(gains)), draw(optional(force)),
        draw(few(st.builds(SetOfMechanisms, sets, SHARES, plain, force, st.booleans()))), study, rows,
        draw(few(st.builds(NuisanceParameter, st.sampled_from(fibres), *[WORDS] * 3, plain, optional(plain), FORCES))),
        draw(few(st.builds(Feature, st.sampled_from(fibres), WORDS, WORDS, plain, plain, plain, st.booleans()))),
        draw(few(st.builds(FeatureScore, WORDS, WORDS, st.integers(1, 84), FORCES, FORCES))),
        maps if draw(st.booleans()) else {}, maps if draw(st.booleans()) else {},
        draw(optional(st.builds(NextExperiment, WORDS, WORDS, sets, force))),
        {}, draw(few(WORDS)), draw(few(WORDS)), draw(few(WORDS)),
    )  # fmt: skip
