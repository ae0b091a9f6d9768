"""The first paragraph of a diagnosis: what differs, where, why, how sure, and what to do next."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from xb_muscle_ros.diagnose.sentences import (
    Facts,
    Piece,
    Sentence,
    answer_names,
    by_chance,
    changes,
    difference,
    explained,
    fibre_words,
    gain,
    how_well,
    memory_law,
    next_step,
    parameter_value,
    sureness,
    together,
    well_below,
    what_helps,
)
from xb_muscle_ros.diagnose.words import family_of, family_words, human, joined, parts, percent
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
    sentences = _TELL.get(str(facts["verdict"]), _unexplained)(facts)
    pieces: list[Piece] = []
    for sentence in sentences:
        pieces += ([Piece(" ")] if pieces else []) + sentence
    return pieces


def _none(facts: Facts) -> list[Sentence]:
    return [
        *how_well(facts, "reproduces the recordings of"),
        *by_chance(facts, "What is left is no larger than chance makes it"),
        [Piece("These recordings call for no other physics and no correction beyond the usual ones.")],
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
    out += by_chance(facts, "What is left is no larger than chance makes it")
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
        *by_chance(facts, "A difference this large"),
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
        *by_chance(facts, "A difference this large"),
        *next_step(facts),
    ]


def _ambiguous(facts: Facts) -> list[Sentence]:
    names = [human(n) for n in answer_names(facts)]
    families = {family_of(part) for name in answer_names(facts) for part in parts(name)}
    kin = (
        f" All belong to one family, {family_words(facts['family'])}." if facts["family"] and len(families) == 1 else ""
    )
    out = difference(facts)
    if names:
        number = {1: "One explanation does best", 2: "Two explanations do"}.get(
            len(names), f"{len(names)} explanations do"
        )
        rivals = "but is not clearly ahead of the others" if len(names) == 1 else "about equally well"
        out.append([Piece(f"{number} {rivals}: {joined(names)}.{kin} These recordings cannot tell which is right.")])
    else:
        out.append([Piece("Several explanations do about equally well; these recordings cannot tell which is right.")])
    out += gain(facts, "With the first of them" if len(names) > 1 else "With it")
    out += by_chance(facts, "A difference this large")
    return out + next_step(facts)


def _unexplained(facts: Facts) -> list[Sentence]:
    tried = sum(1 for row in facts["candidates"] if row["name"] != "base")
    out = difference(facts)
    if tried > 1:
        out.append([Piece("None of the "), Piece(f"{tried}", "candidates"), Piece(" explanations tried removes it.")])
    else:
        out.append([Piece("The only explanation tried does not remove it." if tried else "No explanation removes it.")])
    out += memory_law(facts)
    bound = facts["flexible_bound_rmsd_f0"]
    if bound is not None:
        out.append([
            Piece("A flexible curve without any physics gets the error on trials left out of the fit down to "),
            Piece(f"{percent(bound)} % F0", "flexible_bound"),
            Piece(", so there is something to be found."
                  if well_below(bound, (facts["linear_heldout"] or {}).get("before_rmsd_f0")) else
                  ", hardly better than the model: what it learns in some trials does not help in others."),
        ])  # fmt: skip
    out += by_chance(facts, "A difference this large")
    return out + next_step(facts)


_TELL: Mapping[str, Callable[[Facts], list[Sentence]]] = {
    "none": _none,
    "parameters": _parameters,
    "measurement": _measurement,
    "physics": _physics,
    "ambiguous": _ambiguous,
    "unexplained": _unexplained,
}
