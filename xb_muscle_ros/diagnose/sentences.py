"""Sentences that verdicts share, in pieces whose numbers know how they were computed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from xb_muscle_ros.diagnose.claims import Facts, Piece, Sentence, error_of
from xb_muscle_ros.diagnose.words import SCALES, human, joined, meaning, parts, percent, phase_words, quantity

_MOST_CHANGES = 3
# Parameters that moved less than this share are not worth a word.
_CHANGED = 0.02
# Below this share of the mean square a law describes nothing.
LAW = 0.2
# Where the mean is less than this share of the root mean square, a residual goes both ways.
ONE_WAY = 0.5
_PULLS = {1: "harder than the model", -1: "less than the model", 0: "now harder, now less than the model"}


class Located(NamedTuple):
    """Where the largest mismatch lies.

    Attributes:
        phase: its name.
        sign: 1 where the fibre pulls harder than the model, -1 where less, 0 where both.
        size_f0: largest there.
        rows: mismatches of the same phase and sign.
        others: further phases, in order of size.
    """

    phase: str
    sign: int
    size_f0: float
    rows: tuple[Facts, ...]
    others: tuple[str, ...]


def located(facts: Facts) -> Located | None:
    """Where the largest mismatch lies; None where none was found."""
    rows = [row for row in facts["mismatch"] if row["size_f0"] is not None and row["phase"] is not None]
    if not rows:
        return None
    first = max(rows, key=lambda row: float(row["size_f0"]))
    sign = direction(first)
    same = tuple(row for row in rows if row["phase"] == first["phase"] and direction(row) == sign)
    others = tuple(dict.fromkeys(str(row["phase"]) for row in rows if row["phase"] != first["phase"]))
    return Located(str(first["phase"]), sign, float(first["size_f0"]), same, others)


def direction(row: Facts) -> int:
    """1 where the fibre pulls harder than the model, -1 where less, 0 where it changes within the span."""
    size, mean = row["size_f0"], row["mean_f0"]
    if size is not None and mean is not None and abs(mean) < ONE_WAY * size:
        return 0
    sign = row["sign"] or 0
    return (sign > 0) - (sign < 0)


def fibre_words(facts: Facts) -> str:
    """The fibre, by name where it has one."""
    return f"fibre {facts['fibre']}" if facts["fibre"] else "the fibre"


def answer_names(facts: Facts) -> list[str]:
    """Names in the answer, best first."""
    return [str(name) for name in facts["answer"]]


def how_well(facts: Facts, does: str) -> list[Sentence]:
    """How closely the base model follows the recordings that it was fitted to, and those that it was not."""
    error, how = facts["before"]["train_rmsd_f0"], "rmsd"
    if error is None:
        error, how = error_of(facts, "before")
    if error is None:
        return [[Piece(f"The model {does} {fibre_words(facts)}.")]]
    sentence = [Piece(f"The model {does} {fibre_words(facts)} to within "), Piece(f"{percent(error)} % F0", how)]
    left_out = facts["before"]["heldout_rmsd_f0"]
    if left_out is not None and how == "rmsd":
        sentence += [
            Piece(", and trials left out of the fit to within "),
            Piece(f"{percent(left_out)} % F0", "heldout_rmsd"),
        ]
    return [[*sentence, *_noise(facts), Piece(".")]]


def _noise(facts: Facts) -> Sentence:
    levels = sorted(float(row["noise_sd_f0"]) for row in facts["trials"] if row["noise_sd_f0"] is not None)
    if not levels:
        return []
    level = Piece(f"{percent(levels[len(levels) // 2])} % F0", "noise")
    curves = [Piece(", by what smooth curves leave of force")] if noise_from(facts, "curve") else []
    return [Piece(". The noise of the recordings is "), level, *curves]


def noise_from(facts: Facts, source: str) -> bool:
    """Whether the noise of any trial was taken from there."""
    return any(row["noise_from"] == source for row in facts["trials"])


def difference(facts: Facts) -> list[Sentence]:
    """How large the difference is, and where."""
    error, how = facts["before"]["train_rmsd_f0"], "rmsd"
    if error is None:
        error, how = error_of(facts, "before")
    out: list[Sentence] = [[Piece(f"The model differs from the recordings of {fibre_words(facts)}.")]]
    if error is not None:
        out = [[
            Piece("Fitted as well as it can be, the model still differs from the recordings of "),
            Piece(f"{fibre_words(facts)} by "),
            Piece(f"{percent(error)} % F0", how),
            *_noise(facts),
            Piece("."),
        ]]  # fmt: skip
    where = located(facts)
    if where is None:
        return out
    out.append([
        Piece(f"The difference is largest in the {phase_words(where.phase)} {_conditions(facts, where)}. "
              f"There the fibre pulls {_PULLS.get(where.sign, _PULLS[0])}, by up to "),
        Piece(f"{percent(where.size_f0)} % F0", "mismatch"),
        Piece("." if not where.others else
              f". Smaller differences lie in the {joined([phase_words(p) for p in where.others[:2]])}."),
    ])  # fmt: skip
    return out


def _conditions(facts: Facts, where: Located) -> str:
    pca_of = {row["trial"]: row["pca"] for row in facts["trials"]}
    names = list(dict.fromkeys(row["trial"] for row in where.rows))
    levels = sorted({float(pca_of[name]) for name in names if pca_of.get(name) is not None}, reverse=True)
    total = len(facts["trials"])
    count = f"of all {total} trials" if len(names) == total else f"of {len(names)} of {total} trials"
    if not levels:
        return f"of trial {names[0]}" if len(names) == 1 else count
    solutions = f"pCa {levels[0]:g}" if len(levels) == 1 else f"pCa {levels[0]:g} to {levels[-1]:g}"
    return f"at {solutions}" if len(names) == 1 else f"{count} ({solutions})"


def explained(facts: Facts, names: Sequence[str]) -> str:
    """Names with what they mean."""
    told = [f"{human(name)}, {meaning(name)}" if meaning(name) else human(name) for name in names]
    return joined(told, "together with") if told else "not named"


def parameter_value(facts: Facts) -> Sentence:
    """Value and interval of the new parameter, then the full stop."""
    answer = set(answer_names(facts))
    row = next((row for row in facts["candidates"] if set(parts(str(row["name"]))) == answer), None)
    if row is None or len(row["parameters"]) != 1 or not answer:
        return [Piece(".")]
    ((name, value),) = row["parameters"].items()
    interval = row["interval"].get(name)
    unit = facts["profile"]["unit"] if facts["profile"] and facts["profile"]["parameter"] == name else None
    if value is None:
        return [Piece(".")]
    out = [Piece(". Its parameter "), Piece(f"{name} is {quantity(value, unit)}", "parameters")]
    if interval and None not in interval:
        out += [Piece(", with 95 % certainty between "), Piece(f"{quantity(interval[0], None)}", "interval")]
        out += [Piece(" and "), Piece(f"{quantity(interval[1], unit)}", "interval")]
    return [*out, Piece(".")]


def changes(facts: Facts) -> list[Sentence]:
    """The parameters that moved most."""
    moved = []
    for row in facts["base_parameters"]:
        start, fitted = row["start"], row["fitted"]
        if start is None or fitted is None:
            continue
        share = abs(fitted - start) / max(abs(start), abs(fitted), 1e-300)
        if share >= _CHANGED:
            moved.append((share, row))
    moved.sort(key=lambda pair: -pair[0])
    if not moved:
        return []
    pieces = [Piece("The values that changed most: ")]
    for i, (_, row) in enumerate(moved[:_MOST_CHANGES]):
        pieces.append(Piece(("; " if i else "") + f"{row['name']} from {quantity(row['start'], None)} to "))
        pieces.append(Piece(quantity(row["fitted"], row["unit"]), "base_parameters"))
    return [[*pieces, Piece(".")]]


def memory_law(facts: Facts) -> list[Sentence]:
    """What is left, as a law of the velocity's history."""
    kernel = facts["kernel"]
    if kernel is None or kernel["time_constant_s"] is None:
        return []
    share = kernel["explained"]
    if share is not None and share < LAW:
        return [[
            Piece("It follows no simple memory of the speed of length change: that accounts for "),
            Piece(f"{100.0 * share:.0f} %", "kernel"),
            Piece(" of it."),
        ]]  # fmt: skip
    out = [Piece("What is left follows the speed of length change and fades with a time constant of ")]
    out.append(Piece(f"{quantity(1e3 * kernel['time_constant_s'], 'ms')}", "kernel"))
    if kernel["scales_with"] in SCALES:
        out.append(Piece(f"; it {SCALES[kernel['scales_with']]}"))
    if share is not None:
        out += [Piece(". This law accounts for "), Piece(f"{100.0 * share:.0f} %", "kernel")]
        out.append(Piece(" of it, but describes rather than explains"))
    return [[*out, Piece(".")]]


def next_step(facts: Facts) -> list[Sentence]:
    """The experiment proposed, else what would help."""
    planned = facts["next_experiment"]
    if planned is None:
        return what_helps(facts)
    out = [Piece("Next: run the protocol in the folder next_experiment")]
    if planned["protocol"]:
        out = [Piece(f"Next experiment: {str(planned['protocol']).strip().rstrip('.')}")]
    names = [human(str(name)) for name in planned["separates"] or ()]
    if planned["expected_difference_f0"] is not None and len(names) > 1:
        out.append(Piece(f". There {joined(names)} should differ by "))
        out.append(Piece(f"{percent(planned['expected_difference_f0'])} % F0", "next_experiment"))
    return [[*out, Piece(".")]]


def what_helps(facts: Facts) -> list[Sentence]:
    """The first thing that is missing."""
    if not facts["missing"]:
        return []
    return [[Piece(f"What would tell more: {str(facts['missing'][0]).strip().rstrip('.')}.")]]


def notes(facts: Facts) -> list[Sentence]:
    """What was left out, assumed or not looked at, a sentence each."""
    return [[Piece(f"Note: {str(line).strip().rstrip('.')}.")] for line in facts["notes"]]
