"""From fits to an answer, and when not to give one."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from xb_muscle_ros.diagnose.catalogue import CATALOGUE
from xb_muscle_ros.diagnose.crossval import HeldOut
from xb_muscle_ros.diagnose.gain import Gain
from xb_muscle_ros.diagnose.mismatch import Bound
from xb_muscle_ros.diagnose.names import FAMILY, MEASUREMENT, Name, Verdict
from xb_muscle_ros.diagnose.refit import Fit
from xb_muscle_ros.diagnose.search import PENALTY, Search
from xb_muscle_ros.diagnose.significance import ALPHA
from xb_muscle_ros.diagnose.study import Explanation

# Independent differences that a trial tells of, as a rule: residuals of a muscle hang together over a whole phase.
_TOLD_BY_TRIAL = 2.0
# A rival is out of the race below this share of the best one's weight.
_TIE = 0.05
# Share of the mismatch's mean square that the first name explains all by itself; or else all names together, and the
# first one of what the others leave. Effects that nobody thought of are mended in part by many a pair.
_ALONE, _TOGETHER, _OF_THE_REST = 0.75, 0.9, 0.85
# Share that is gone where the mismatch was located.
_CLEANED = 0.7
# A name belongs to the answer if without it this share of the mismatch would come back; a mechanism also has a doing of
# its own of at least this size, F0, and this share of what the others leave.
_PART, _OWN_F0, _OWN_SHARE = 0.05, 0.002, 0.4
# What a fault does to a recording is known, other than the form of a mechanism: it leaves no more than this.
_FAULTS_LEAVE_F0 = 0.004
# Of the held-out gain of a discrepancy without physics, an answer reaches this share.
_OF_FLEXIBLE = 0.5
# A start whose difference is within this factor of the refitted one needed no refit.
_AS_GOOD = 1.5


_NO_FAULT = "no fault of the measurement explains as much"
_APART = "the interval of its parameter excludes 0"
_BETTER = "held-out trials are predicted better"
# What rivals make fail, and so does not speak against being ambiguous.
_OF_RIVALS = (_NO_FAULT, _APART)


class Check(NamedTuple):
    """One condition of an answer.

    Attributes:
        name: in words.
        passed: whether it holds.
        value: what was found, in words.
    """

    name: str
    passed: bool
    value: str


class Decision(NamedTuple):
    """What the diagnosis says.

    Attributes:
        verdict: as a whole.
        answer: names, best first.
        family: that all names share, or None.
        confidence: weight of the first name among all that were fitted in its place, times what it explains; None
            where nothing is named.
        checks: conditions of a named mechanism.
        ties: names that the data do not tell from the first one.
        gain: of the explanation that was arrived at on held-out trials; None where none was, or none were held out.
    """

    verdict: Verdict
    answer: tuple[Name, ...]
    family: str | None
    confidence: float | None
    checks: tuple[Check, ...]
    ties: tuple[Name, ...]
    gain: Gain | None = None


@dataclass(frozen=True)
class Evidence:
    """What a decision rests on.

    Attributes:
        search: fits.
        start_rmsd_f0: of the fibre file as given.
        noise_f0: root-mean-square of the noise.
        detected: whether the base leaves more than noise and than is of use.
        p_value: of what the base leaves.
        heldout: scores by label.
        bound: what a flexible discrepancy foretells of trials left out beside base and answer, or None.
        interval: of the leading mechanism's effect, or None where it has none.
        at_bound: whether that effect ended at a bound.
        cleaned: share of the located cells' mean square that is gone afterwards.
        described: whether the base describes the recordings at all, and their noise leaves something to be seen.
    """

    search: Search
    start_rmsd_f0: float
    noise_f0: float
    detected: bool
    p_value: float
    heldout: Mapping[str, HeldOut]
    bound: Bound | None
    interval: tuple[float, float] | None
    at_bound: bool
    cleaned: float
    described: bool = True


def decide(e: Evidence) -> Decision:
    """The answer that the evidence allows."""
    search = e.search
    if not e.described:
        return Decision(Verdict.UNEXPLAINED, (), None, None, (), ())
    if not e.detected:
        fine = e.start_rmsd_f0 <= max(_AS_GOOD * search.base.rmsd_f0, 0.003)
        return Decision(Verdict.NONE if fine else Verdict.PARAMETERS, (), None, None, (), ())
    explanation = search.final.explanation
    if not explanation.names:
        return Decision(Verdict.UNEXPLAINED, (), None, None, (), ())
    share = explained(search.base, search.final, e.noise_f0)
    first = _by_importance(search, explanation.names)[0]
    part = [n for n in explanation.names if n is first or _comes_back(search, n, e.noise_f0) >= _PART]
    mechanisms = _by_importance(
        search, [n for n in part if n in explanation.mechanisms and _has_own_doing(search, n, e.noise_f0)]
    )
    faults = _by_importance(search, [n for n in part if n in explanation.faults])
    lead = (mechanisms or faults or list(explanation.names))[0]
    weights = weights_against(search, lead, len(search.study.trials))
    ties = tuple(n for n, w in weights.items() if n is not lead and w >= _TIE * weights[lead])
    gain = _gain(e, bool(mechanisms))
    checks = _checks(e, lead, share, weights, bool(mechanisms), gain)
    none = Decision(Verdict.UNEXPLAINED, (), None, None, checks, ties, gain)
    if not (mechanisms or faults) or not _explains(search, lead, share, e.noise_f0).passed:
        return none
    family = FAMILY[lead] if all(FAMILY[n] == FAMILY[lead] for n in ties) else None
    open_to = _OF_RIVALS if family is None else ()
    if not all(c.passed for c in checks if c.name not in open_to):
        return none
    answer = tuple(dict.fromkeys((*mechanisms, *faults, *ties)))
    verdict = Verdict.AMBIGUOUS if family is None else Verdict.PHYSICS if mechanisms else Verdict.MEASUREMENT
    confidence = weights[lead] * max(0.0, min(1.0, share))
    return Decision(verdict, answer, family, confidence, checks, ties, gain)


def _gain(e: Evidence, physics: bool) -> Gain | None:
    before = e.heldout.get(e.search.base.explanation.label)
    after = e.heldout.get(e.search.final.explanation.label)
    return None if before is None or after is None else Gain.of(before, after, not physics)


def explained(before: Fit, after: Fit, noise_f0: float) -> float:
    """Share of the mean square beyond noise that one fit has over another."""
    excess = before.rmsd_f0**2 - noise_f0**2
    return (before.rmsd_f0**2 - after.rmsd_f0**2) / excess if excess > 0.0 else 0.0


def _by_importance(search: Search, names: Sequence[Name]) -> list[Name]:
    """Names by what the cost rises without them."""

    def rise(name: Name) -> float:
        without = search.fits.get(search.final.explanation.without(name).label, search.base)
        return without.cost - search.final.cost

    return sorted(names, key=rise, reverse=True)


def _has_own_doing(search: Search, name: Name, noise_f0: float) -> bool:
    """Whether a mechanism does more than tidy up what others left."""
    without = search.fits.get(search.final.explanation.without(name).label, search.base)
    own = max(without.rmsd_f0**2 - search.final.rmsd_f0**2, 0.0)
    return math.sqrt(own) >= _OWN_F0 and explained(without, search.final, noise_f0) >= _OWN_SHARE


def _comes_back(search: Search, name: Name, noise_f0: float) -> float:
    """Share of the base's mismatch that is there again without a name."""
    without = search.fits.get(search.final.explanation.without(name).label, search.base)
    excess = search.base.rmsd_f0**2 - noise_f0**2
    return (without.rmsd_f0**2 - search.final.rmsd_f0**2) / excess if excess > 0.0 else 0.0


def _explains(search: Search, lead: Name, share: float, noise_f0: float) -> Check:
    """Whether the answer explains enough, and its first name not only beside others."""
    single = search.fits.get(Explanation().plus(lead).label, search.base)
    alone = explained(search.base, single, noise_f0)
    without = search.fits.get(search.final.explanation.without(lead).label, search.base)
    of_rest = explained(without, search.final, noise_f0)
    passed = alone >= _ALONE or (share >= _TOGETHER and of_rest >= _OF_THE_REST)
    return Check(
        f"it explains {100 * _ALONE:.0f} % of the mismatch alone, or {100 * _TOGETHER:.0f} % with others and "
        f"{100 * _OF_THE_REST:.0f} % of what these leave",
        passed,
        f"{100 * alone:.0f} % alone, {100 * share:.0f} % in all, {100 * of_rest:.0f} % of the rest",
    )


def weights_against(search: Search, lead: Name, trials: int) -> dict[Name, float]:
    """Weights of a name and of all that were fitted in its place; they sum to 1.

    The likelihood of differences of unknown size, with as many independent ones as trials have phases to speak of.
    """
    told = _TOLD_BY_TRIAL * trials
    fits = {lead: search.final}
    rest = search.fits.get(search.final.explanation.without(lead).label)
    for rival in search.rivals(lead):
        # What does nothing beside the others is no rival, even if they leave little to do.
        if rest is not None and rest.cost - rival.cost < 2.0 * PENALTY:
            continue
        name = next(n for n in rival.explanation.names if n not in search.final.explanation.without(lead).names)
        fits.setdefault(name, rival)
    logs = {}
    for name, fit in fits.items():
        parameters = 1 if name in MEASUREMENT else len(CATALOGUE[name].parameters)
        logs[name] = -0.5 * told * math.log(max(fit.cost, 1e-12)) - parameters
    best = max(logs.values())
    raw = {name: math.exp(value - best) for name, value in logs.items()}
    total = sum(raw.values())
    return {name: value / total for name, value in raw.items()}


def _checks(
    e: Evidence, lead: Name, share: float, weights: Mapping[Name, float], physics: bool, gain: Gain | None
) -> tuple[Check, ...]:
    checks = [
        Check(f"the mismatch is no noise (bootstrap p < {ALPHA:g})", e.p_value < ALPHA, f"p = {e.p_value:.2g}"),
        _explains(e.search, lead, share, e.noise_f0),
        Check(
            "the places where the mismatch was found are clean afterwards",
            e.cleaned >= _CLEANED,
            f"{100 * e.cleaned:.0f} % of the mean square there is gone",
        ),
    ]
    if physics:
        rival = max((w for n, w in weights.items() if n in MEASUREMENT), default=0.0)
        checks.append(
            Check(
                _NO_FAULT,
                rival < _TIE * weights[lead],
                f"weight of the best one {rival:.2g}",
            )
        )
        if e.interval is not None:
            apart = not e.interval[0] <= 0.0 <= e.interval[1]
            checks.append(Check(_APART, apart, f"{e.interval[0]:.3g} to {e.interval[1]:.3g}"))
        checks.append(
            Check("its parameter is off its bounds", not e.at_bound, "at a bound" if e.at_bound else "inside")
        )
    else:
        left = e.search.final.rmsd_f0
        checks.append(Check("faults leave next to nothing", left <= _FAULTS_LEAVE_F0, f"{100.0 * left:.2f} % F0"))
    checks += _heldout_checks(e, gain)
    return tuple(checks)


def _heldout_checks(e: Evidence, gain: Gain | None) -> list[Check]:
    if gain is None:
        return [Check(_BETTER, False, "too few trials to hold any out")]
    found = [Check(_BETTER, gain.better, gain.words)]
    of_flexible = e.bound.share(gain.after_f0) if e.bound is not None else None
    if of_flexible is not None:
        found.append(
            Check(
                "its held-out gain is at least half of what a discrepancy without physics gets",
                of_flexible >= _OF_FLEXIBLE,
                f"{of_flexible:.2f} of it",
            )
        )
    return found
