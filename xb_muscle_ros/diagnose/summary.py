"""The first paragraph of a diagnosis: what differs, where, why, how sure, and what to do next."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from xb_muscle_ros.diagnose.claims import (
    Facts,
    Piece,
    Sentence,
    by_chance,
    flexible,
    gain,
    judged,
    rivals,
    sureness,
    together,
)
from xb_muscle_ros.diagnose.sentences import (
    answer_names,
    changes,
    difference,
    explained,
    fibre_words,
    how_well,
    memory_law,
    next_step,
    notes,
    parameter_value,
    what_helps,
)
from xb_muscle_ros.diagnose.words import family_words, human, joined, percent
from xb_muscle_ros.diagnose.written import filled


def summary_text(diagnosis: Facts) -> str:
    """The paragraph as plain text.

    Args:
        diagnosis: as in ``diagnosis.json``; ``summary`` itself is not used, missing values are left out.
    """
    return "".join(piece.text for piece in summary_pieces(diagnosis))


def summary_pieces(diagnosis: Facts) -> list[Piece]:
    """The paragraph in pieces, so that a page can link each number to how it was computed."""
    facts = filled(diagnosis)
    tell = _TELL.get(str(facts["verdict"]), _unexplained) if judged(facts) else _not_judged
    sentences = [*tell(facts), *notes(facts)]
    pieces: list[Piece] = []
    for sentence in sentences:
        pieces += ([Piece(" ")] if pieces else []) + sentence
    return pieces


def _none(facts: Facts) -> list[Sentence]:
    return [
        *how_well(facts, "reproduces the recordings of"),
        *by_chance(facts),
        [Piece("These recordings call for no other physics and no correction of the measurement.")],
        *what_helps(facts),
    ]


def _parameters(facts: Facts) -> list[Sentence]:
    start, before = facts["start"]["train_rmsd_f0"], facts["before"]["train_rmsd_f0"]
    out: list[Sentence] = []
    if start is not None and before is not None:
        out.append([
            Piece(f"With the values of its file, the model of {fibre_words(facts)} differs from the recordings by "),
            Piece(f"{percent(start)} % F0", "start_rmsd"),
            Piece("; with its own parameters estimated anew, by "),
            Piece(f"{percent(before)} % F0", "rmsd"),
            Piece("."),
        ])  # fmt: skip
    else:
        out += how_well(facts, "reproduces, once its own parameters are estimated anew, the recordings of")
    out += changes(facts)
    out.append([Piece("Other values of the same parameters are enough: these recordings call for no other physics.")])
    out += by_chance(facts)
    return out + what_helps(facts)


def _measurement(facts: Facts) -> list[Sentence]:
    names = answer_names(facts)
    return [
        *difference(facts),
        [
            Piece(f"The best explanation is no physics but the measurement: {explained(facts, names)}"),
            *parameter_value(facts),
        ],
        *gain(facts, "With that corrected"),
        *sureness(facts),
        *by_chance(facts),
        [Piece("Check the recording for it before looking for physics.")],
        *next_step(facts),
    ]


def _physics(facts: Facts) -> list[Sentence]:
    names = answer_names(facts)
    rivals = len(names) > 1 and not together(facts)
    if rivals:
        family = f" of the family {family_words(facts['family'])}" if facts["family"] else ""
        what = [Piece(f"The best explanation is one{family}: {joined([human(n) for n in names], 'or')}")]
    else:
        what = [Piece(f"The best explanation is {explained(facts, names)}")]
    return [
        *difference(facts),
        [*what, *parameter_value(facts)],
        *gain(facts, "With the first of them" if rivals else "With it"),
        *sureness(facts),
        *by_chance(facts),
        *next_step(facts),
    ]


def _ambiguous(facts: Facts) -> list[Sentence]:
    return [
        *difference(facts),
        rivals(facts),
        *gain(facts, "With the first of them" if len(answer_names(facts)) > 1 else "With it"),
        *sureness(facts),
        *by_chance(facts),
        *next_step(facts),
    ]


def _unexplained(facts: Facts) -> list[Sentence]:
    rows = [row for row in facts["candidates"] if row["name"] != "base"]
    tried = sum(1 for row in rows if row["train_rmsd_f0"] is not None)
    out = difference(facts)
    if tried > 1:
        none = [Piece("None of the "), Piece(f"{tried}", "candidates"), Piece(" explanations fitted removes it")]
    else:
        none = [Piece("The only explanation fitted does not remove it" if tried else "No explanation removes it")]
    if len(rows) > tried:
        none += [
            Piece("; "),
            Piece(f"{len(rows) - tried}", "candidates"),
            Piece(" more promised too little to be fitted"),
        ]
    out.append([*none, Piece(".")])
    return [*out, *memory_law(facts), *flexible(facts), *by_chance(facts), *next_step(facts)]


def _not_judged(facts: Facts) -> list[Sentence]:
    return [
        *difference(facts),
        [Piece("These recordings cannot be judged with this model, so that nothing is named.")],
        *by_chance(facts),
        *what_helps(facts),
    ]


_TELL: Mapping[str, Callable[[Facts], list[Sentence]]] = {
    "none": _none,
    "parameters": _parameters,
    "measurement": _measurement,
    "physics": _physics,
    "ambiguous": _ambiguous,
    "unexplained": _unexplained,
}
