"""What a diagnosis may claim: each sentence that judges is made here, for summary and report alike.

So that no two of them contradict each other, each looks at the facts that decide, not at the verdict's usual case.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from xb_muscle_ros.diagnose.gain import LESS
from xb_muscle_ros.diagnose.significance import ALPHA, FLOOR_F0
from xb_muscle_ros.diagnose.words import chance, family_of, family_words, human, joined, likely, parts, percent

Facts = Mapping[str, Any]

QUIET = ("none", "parameters")
"""Verdicts by which nothing is missing."""
# The first of several rivals does best where it is right as likely as this.
_LEADS = 0.66


class Piece(NamedTuple):
    """A piece of a sentence.

    Attributes:
        text: as it reads.
        how: where it is a number, the entry of ``how`` that tells how it was computed.
    """

    text: str
    how: str | None = None


Sentence = list[Piece]


def judged(facts: Facts) -> bool:
    """Whether the recordings could be judged at all: the model describes them, and noise does not hide all."""
    return facts["described"] is not False


def beyond_chance(facts: Facts) -> bool:
    """Whether what the base model leaves is more than noise makes it."""
    return facts["p_value"] is not None and facts["p_value"] < ALPHA


def together(facts: Facts) -> bool:
    """Whether several names in the answer act together, rather than being rivals that cannot be distinguished."""
    answer = facts["answer"]
    if facts["verdict"] == "ambiguous" or len(answer) < 2:
        return False
    best = next((row for row in facts["candidates"] if row["name"] != "base"), None)
    if best is not None and best["kind"] == "pair":
        return set(parts(str(best["name"]))) == set(answer)
    families = {family_of(str(name)) for name in answer}
    return not (facts["family"] and families == {facts["family"]})


def by_chance(facts: Facts) -> list[Sentence]:
    """How often chance does as much, and what follows."""
    p_value = facts["p_value"]
    if p_value is None:
        return []
    often = Piece(chance(p_value), "p_value")
    if facts["verdict"] in QUIET and beyond_chance(facts):
        return [[
            Piece("What is left is more than chance alone leaves ("), often,
            Piece("), but it stays below what counts: "), Piece(f"{percent(FLOOR_F0)} % F0", "mismatch"),
            Piece(" for a tenth of a second."),
        ]]  # fmt: skip
    if facts["verdict"] in QUIET:
        return [
            [Piece("What is left is no larger than chance makes it: chance alone leaves as much "), often, Piece(".")]
        ]
    end = "." if beyond_chance(facts) else ": it may be nothing but noise."
    return [[Piece("A difference this large comes about by chance "), often, Piece(end)]]


def sureness(facts: Facts) -> list[Sentence]:
    """How likely the answer is the right one; nothing where nothing is named."""
    share = facts["confidence"]
    if share is None or not facts["answer"] or facts["verdict"] in (*QUIET, "unexplained"):
        return []
    several = len(facts["answer"]) > 1 and not together(facts)
    which = "the first of them" if several else "this"
    return [
        [
            Piece(f"That {which} is the right explanation among those tried is {likely(share)} ("),
            Piece(f"{100.0 * share:.0f} %", "confidence"),
            Piece(")."),
        ]
    ]


def rivals(facts: Facts) -> Sentence:
    """Explanations that the recordings do not tell apart."""
    named = [str(name) for name in facts["answer"]]
    names = [human(name) for name in named]
    if not names:
        return [Piece("Several explanations do about equally well; these recordings cannot tell which is right.")]
    families = {family_of(part) for name in named for part in parts(name)}
    family = family_words(str(facts["family"])) if facts["family"] and len(families) == 1 else ""
    kin = f" All belong to one family, {family}." if family else ""
    if len(names) == 1:
        return [Piece(f"One explanation does best but is not clearly ahead of the others: {names[0]}.{kin}")]
    if facts["confidence"] is not None and facts["confidence"] >= _LEADS:
        return [
            Piece(f"One explanation does best, {names[0]}, but {joined(names[1:], 'or')} cannot be ruled out.{kin}")
        ]
    number = "Two" if len(names) == 2 else str(len(names))
    return [
        Piece(
            f"{number} explanations do about equally well: {joined(names)}.{kin} "
            "These recordings cannot tell which is right."
        )
    ]


def error_of(facts: Facts, which: str) -> tuple[float | None, str]:
    """Error on trials left out of the fit, or on those fitted where there were none left out."""
    group = facts[which]
    if group["heldout_rmsd_f0"] is not None:
        return group["heldout_rmsd_f0"], "heldout_rmsd"
    return group["train_rmsd_f0"], "rmsd"


def moves(before: float, after: float) -> str:
    """What an error does: the same word wherever the two stand side by side."""
    if after <= LESS * before:
        return "falls"
    if percent(before) == percent(after):
        return "stays the same"
    return "hardly falls" if after < before else "rises"


def gain(facts: Facts, when: str) -> list[Sentence]:
    """What the answer does to the error, beside what a flexible curve does."""
    (before, how), (after, how_after) = error_of(facts, "before"), error_of(facts, "after")
    if before is None or after is None or how != how_after:
        return []
    heldout = how == "heldout_rmsd"
    trials = "trials left out of the fit" if heldout else "the trials fitted"
    verb = moves(before, after)
    out = [Piece(f"{when}, the error on {trials} {verb}"), *_from_to(before, after, how, verb)]
    if heldout:
        out += _usual(facts, verb)
    bound = facts["flexible_bound_rmsd_f0"]
    # A curve that learns nothing for other trials is no yardstick.
    if bound is not None and heldout and bound < before:
        out += [
            Piece(". A flexible curve without any physics gets to "),
            Piece(f"{percent(bound)} % F0", "flexible_bound"),
        ]
    return [[*out, Piece(".")]]


def _from_to(before: float, after: float, how: str, verb: str) -> Sentence:
    if verb == "stays the same":
        return [Piece(", "), Piece(f"{percent(after)} % F0", how)]
    return [Piece(" from "), Piece(percent(before), how), Piece(" to "), Piece(f"{percent(after)} % F0", how)]


def _usual(facts: Facts, verb: str) -> Sentence:
    """Where the error over all samples does not fall, that of the usual trial, if that is what counts and does."""
    found = facts["heldout_gain"]
    if verb == "falls" or found is None or not found["of_faults"] or not found["better"]:
        return []
    return [
        Piece(", but that of the usual trial falls from "),
        Piece(percent(found["usual_before_f0"]), "heldout_gain"),
        Piece(" to "),
        Piece(f"{percent(found['usual_after_f0'])} % F0", "heldout_gain"),
    ]


def flexible(facts: Facts) -> list[Sentence]:
    """Whether a curve without physics finds anything that holds for other trials."""
    bound = facts["flexible_bound_rmsd_f0"]
    before = (facts["linear_heldout"] or {}).get("before_rmsd_f0")
    if bound is None or before is None:
        return []
    numbers = [
        Piece(percent(before), "flexible_bound"),
        Piece(" to "),
        Piece(f"{percent(bound)} % F0", "flexible_bound"),
    ]
    if bound < LESS * before:
        return [[
            Piece("A flexible curve without any physics brings the error on trials left out of the fit from "),
            *numbers, Piece(", so there is something to be found."),
        ]]  # fmt: skip
    return [[
        Piece("A flexible curve without any physics hardly helps on trials left out of the fit ("), *numbers,
        Piece("): what it learns in some trials does not hold in others."),
    ]]  # fmt: skip


_HEADLINES = {
    "none": "Nothing beyond chance",
    "measurement": "A fault of the measurement",
    "parameters": "Other parameter values, no other physics",
    "physics": "Physics that was left out",
    "ambiguous": "More than one explanation",
    "unexplained": "A real difference that nothing tried explains",
}
_MEANINGS = {
    "none": "The model as it is, with its parameters estimated, leaves no more than noise like that of the recordings "
    "does.",
    "parameters": "The model reproduces the recordings once its own parameters are estimated anew. What differs can be "
    "had from the parameters; an effect that parameters can imitate cannot be seen in these recordings.",
    "unexplained": "The difference is beyond chance, but no mechanism or fault offered removes it. It is described "
    "below, not explained.",
}


def headline(facts: Facts) -> str:
    """The verdict in a line of plain text."""
    verdict = str(facts["verdict"])
    if not judged(facts):
        return "Recordings that cannot be judged"
    if verdict == "none" and beyond_chance(facts):
        return "Nothing large enough to matter"
    if verdict == "unexplained" and facts["p_value"] is not None and not beyond_chance(facts):
        return "Nothing that can be named"
    words = _HEADLINES.get(verdict, "No verdict")
    names = [human(str(name)) for name in facts["answer"]]
    if not names:
        return words
    return f"{words}: {joined(names, 'and' if together(facts) else 'or')}"


def what_it_means(facts: Facts) -> str:
    """The verdict in a sentence or two; empty where the names say it."""
    verdict = str(facts["verdict"])
    if not judged(facts):
        return "The model does not describe the recordings, or their noise hides what is looked for. Nothing is named."
    if verdict == "none" and beyond_chance(facts):
        return (
            "The model as it is, with its parameters estimated, leaves more than noise does, but nowhere enough to "
            "look for its cause."
        )
    if verdict == "ambiguous":
        return "An experiment has to decide between them."
    if verdict == "unexplained" and facts["p_value"] is not None and not beyond_chance(facts):
        return "What differs may be noise, and no mechanism or fault offered removes it."
    return _MEANINGS.get(verdict, "")
