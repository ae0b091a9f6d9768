"""The headline and the first paragraph: what differs and where, its causes and how sure, what remains, what is next.

Every word follows from a number of the record, so that no sentence can say other than the tables do.
"""

from __future__ import annotations

import math

from xb_muscle_ros.diagnose.component import NAMED, SURE, Component
from xb_muscle_ros.diagnose.report import phrases as say
from xb_muscle_ros.diagnose.residual import ResidualLaw
from xb_muscle_ros.diagnose.result import Diagnosis, Verdict
from xb_muscle_ros.diagnose.words import SCALES, chance, human, joined, quantity

MOST = 6
"""Sentences of a summary."""
_MOST_CAUSES, _MOST_CHANGES = 4, 3
# Of candidates that are not named.
_WORTH_A_WORD = 0.1
# Parameters that moved less than this share are not worth a word.
_CHANGED = 0.02
_HIGHER = {1: "higher than", -1: "lower than", 0: "by turns higher and lower than"}
_UNJUDGED = "the model does not describe these recordings, or noise hides what is looked for"


def headline(d: Diagnosis) -> str:
    """The diagnosis in one line."""
    found, artefacts = say.mechanisms(d.named), say.artefacts(d.named)
    word = d.verdict.value.capitalize()
    if not d.described:
        return f"Not judged: {_UNJUDGED}"
    if d.verdict is Verdict.PHYSICS and found:
        many = "explain" if len(d.named) > 1 else "explains"
        names = joined([say.title(c) for c in [*found, *artefacts]])
        return f"{word}: {names} {many} {_explained(d)} of the mismatch; {say.force(d.residual.rmsd_f0)} remain"
    if d.verdict is Verdict.MEASUREMENT and artefacts:
        return f"{word}: {joined([say.title(c) for c in artefacts])} beyond what is ordinary"
    if d.named:
        unsure = f"; {_unsure(found)}" if d.verdict is Verdict.AMBIGUOUS and found else ""
        return f"{word}: evidence for {joined([_with_probability(c) for c in (found if unsure else d.named)])}{unsure}"
    if d.verdict is Verdict.NONE:
        return f"{word}: these recordings do not call for another model"
    if d.verdict is Verdict.PARAMETERS:
        return f"{word}: other values of the same parameters are enough"
    return f"{word}: the base model differs by {say.force(d.before.train_rmsd_f0)}; {_none_of(d)}"


def _none_of(d: Diagnosis) -> str:
    """That no candidate is named, and which one comes first where one has some probability."""
    none = f"none of the {len(d.components)} candidates" if len(d.components) > 1 else "no candidate"
    first = max(d.components, key=lambda c: c.inclusion_probability, default=None)
    if first is None or not first.inclusion_probability >= _WORTH_A_WORD:
        return f"{none} explains it"
    rivals = joined([human(name) for name in first.not_separable_from], "or")
    rivals = f", not separable from {rivals}" if rivals else ""
    return f"{none} is probable enough to be named, first of them {_with_probability(first)}{rivals}"


def _with_probability(c: Component) -> str:
    return f"{say.title(c)} ({say.probability(c.inclusion_probability)})"


def summary(d: Diagnosis) -> tuple[str, ...]:
    """At most `MOST` sentences."""
    if not d.described:
        lines = [_difference(d), *_where(d), f"Nothing is named: {_UNJUDGED}.", *_chance(d), *_missing(d)]
    elif d.named:
        lines = _with_causes(d)
    elif d.verdict in (Verdict.NONE, Verdict.PARAMETERS):
        lines = [_difference(d, "follows"), *_enough(d), *_chance(d), _best(d), *(_missing(d) or [_nothing_next(d)])]
    else:
        lines = [_difference(d), *_where(d), _best(d), *_law(d.residual.law or d.base_law), *_next(d)]
    return tuple(lines)


def _with_causes(d: Diagnosis) -> list[str]:
    after = _next(d)
    before = [_difference(d), *_where(d), *_causes(d), *_artefacts(d)]
    effect, remains = _effect(d), _remains(d)
    if len(before) + len(after) + 2 > MOST:
        return [*before, f"{effect}; {remains[0].lower()}{remains[1:]}.", *after]
    law = _law(d.residual.law) if len(before) + len(after) + 3 <= MOST else []
    return [*before, f"{effect}.", f"{remains}.", *law, *after]


def _difference(d: Diagnosis, verb: str = "differs from") -> str:
    count = sum(f.used for f in d.features)
    tables = f" and {count} tabulated feature{'s' if count > 1 else ''}" if count else ""
    base, by = ("base model", "by") if verb == "differs from" else ("model", "to within")
    noise = f"; their noise is {say.force(d.residual.noise_f0)}" if math.isfinite(d.residual.noise_f0) else ""
    return (
        f"The {base} {d.model}, fitted with ordinary measurement artefacts{tables}, {verb} the recordings of "
        f"{say.fibres(d)} {by} {say.force(d.before.train_rmsd_f0)}{noise}."
    )


def _where(d: Diagnosis) -> list[str]:
    if not d.mismatch:
        return []
    first = d.mismatch[0]
    size = say.largest(d.mismatch)
    return [
        f"The difference is largest in the {say.where(d, d.mismatch)}, where measured force is "
        f"{_HIGHER[say.way(first)]} the model's ({size} root mean square)."
    ]


def _clause(d: Diagnosis, c: Component, what: str) -> str:
    """One cause with its probability; `what` it is part of, or empty where that was said."""
    name = say.title(c)
    if len(c.members) > 1:
        name += ", which these recordings cannot tell apart,"
    again, of = say.replicated(c)
    fibres = f"; replicated in {again} of {of} fibres" if of > 1 else ""
    value = f"({'probability ' if what else ''}{say.probability(c.inclusion_probability)}{fibres})"
    word = say.sureness(c.inclusion_probability)
    return f"{name} is {word} {what} {value}" if what else f"{name} {word} {value}"


def _listed(d: Diagnosis, found: list[Component], what: str) -> str:
    clauses = [_clause(d, c, "" if k else what) for k, c in enumerate(found[:_MOST_CAUSES])]
    more = len(found) - len(clauses)
    text = "; ".join(clauses) + (f"; and {more} more" if more else "")
    return text[0].upper() + text[1:]


def _causes(d: Diagnosis) -> list[str]:
    found = say.mechanisms(d.named)
    if not found:
        return [_best(d)] if say.mechanisms(d.components) else []
    text = _listed(d, found, "part of what the base model lacks")
    return [f"{text}; {_unsure(found)}." if d.verdict is Verdict.AMBIGUOUS else f"{text}."]


def _unsure(found: list[Component]) -> str:
    """Why mechanisms with evidence are no verdict."""
    sure = [c for c in found if c.inclusion_probability >= SURE]
    if not sure:
        return f"none reaches {SURE:g}" if len(found) > 1 else f"that does not reach {SURE:g}"
    if all(c.heldout_gain is None for c in sure):
        return "no held-out condition tested it"
    if any(c.heldout_gain is not None and c.heldout_gain.beyond_error for c in sure):
        return "the evidence is not clear"
    return "no held-out gain exceeds its standard error"


def _artefacts(d: Diagnosis) -> list[str]:
    found = say.artefacts(d.named)
    return [f"{_listed(d, found, 'a measurement artefact beyond the ordinary')}."] if found else []


def _best(d: Diagnosis) -> str:
    """That no mechanism is named, and which came nearest."""
    found = sorted(say.mechanisms(d.components), key=lambda c: -c.inclusion_probability)
    if not found:
        return "No mechanism was a candidate."
    nearest = found[0]
    value = say.probability(nearest.inclusion_probability)
    return f"No mechanism reaches a probability of {NAMED:g}; the most probable is {say.title(nearest)} ({value})."


def _explained(d: Diagnosis) -> str:
    text = say.share(d.explained_fraction)
    known = {"0 %": "none", "100 %": "all", say.NOTHING: "an unknown share"}
    return known.get(text, text.replace("< ", "less than ").replace("> ", "more than "))


def _effect(d: Diagnosis) -> str:
    many = len(d.named) > 1
    out = f"{'Together they explain' if many else 'It explains'} {_explained(d)} of the mismatch"
    before, after = d.before.heldout_rmsd_f0, d.after.heldout_rmsd_f0
    if before is None or after is None or not (math.isfinite(before) and math.isfinite(after)):
        return f"{out}, untested on held-out conditions"
    low, high = say.force(after, ""), say.force(before, "")
    if low == high:
        return f"{out} and {'leave' if many else 'leaves'} the held-out RMSD at {low} % F0"
    verb = "lower" if after < before else "raise"
    return f"{out} and {verb}{'' if many else 's'} the held-out RMSD from {high} to {low} % F0"


def _remains(d: Diagnosis) -> str:
    places = d.residual.places
    out = f"{'They leave' if len(d.named) > 1 else 'It leaves'} {say.force(d.residual.rmsd_f0)}"
    return f"{out}, most in the {say.where(d, places)}" if places else f"{out}, and no place stands out"


def _law(law: ResidualLaw | None) -> list[str]:
    if law is None or not math.isfinite(law.time_constant_s):
        return []
    scales = f" and {SCALES[law.scales_with]}" if law.scales_with in SCALES else ""
    constant = quantity(1e3 * law.time_constant_s, "ms")
    return [
        f"The residual decays after a stretch with a time constant of {constant}{scales}. This describes "
        f"{say.share(law.explained_fraction)} of it and does not explain it."
    ]


def _enough(d: Diagnosis) -> list[str]:
    if d.verdict is Verdict.NONE:
        return ["The fibre file as given does as well as the refitted model."]
    moved = []
    for row in d.by_fibre:
        for name, start, fitted, unit in row.base_parameters:
            change = abs(fitted - start) / max(abs(start), abs(fitted), 1e-300)
            if math.isfinite(change) and change >= _CHANGED:
                of = f" ({row.fibre})" if len(d.fibres) > 1 else ""
                moved.append((change, f"{name} from {say.number(start)} to {say.number(fitted, unit)}{of}"))
    moved.sort(key=lambda pair: -pair[0])
    which = f"; most changed {', '.join(text for _, text in moved[:_MOST_CHANGES])}" if moved else ""
    return [f"Other values of the same parameters are enough{which}."]


def _chance(d: Diagnosis) -> list[str]:
    return [f"Noise alone leaves as much {chance(d.p_value)}."] if 0.01 <= d.p_value <= 1.0 else []


def _missing(d: Diagnosis) -> list[str]:
    return [f"A firmer answer needs: {d.missing[0].strip().rstrip('.')}."] if d.missing else []


def _nothing_next(d: Diagnosis) -> str:
    if d.verdict is Verdict.PARAMETERS:
        return "Next: use the fitted values; no experiment is called for."
    return "No experiment is called for."


def _next(d: Diagnosis) -> list[str]:
    planned = d.next_experiment
    if planned is not None:
        names = [say.called(d, name) for name in planned.separates]
        text = f"Next: record {planned.protocol.strip().rstrip('.')}"
        if len(names) > 1 and math.isfinite(planned.expected_difference_f0):
            text += f", which separates {joined(names)} by {say.force(planned.expected_difference_f0)}"
        return [f"{text} (folder {planned.bag})."]
    if d.named and not say.mechanisms(d.named):
        return [f"Next: check the recordings for {joined([human(c.name) for c in d.named])}."]
    if d.missing:
        return _missing(d)
    if d.named:
        return ["Next: test the augmented fibre on recordings that this study did not have."]
    return [f"Next: look at the residual; {_none_of(d)}."]
