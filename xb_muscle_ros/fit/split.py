"""Which trials are kept out of a fit: by name, by condition, or as the paper did."""

from __future__ import annotations

import fnmatch
from collections.abc import Callable, Sequence

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.trials.trial import TrialFacts

# What a rule's number is compared with, and its unit.
_FACTS = {"pca": ("pca", ""), "amplitude": ("amplitude_l0", " L0"), "recovery": ("recovery_s", " s")}
# Conditions are nominal; measured amplitudes differ from them by up to 6 %.
_NEAR = {"pca": 0.01, "amplitude": 0.003}
_RECOVERY_FACTOR = 1.5


def _close(key: str, facts: TrialFacts, wanted: float) -> bool:
    value = getattr(facts, _FACTS[key][0])
    if value is None:
        return False
    if key == "recovery":
        return bool(wanted / _RECOVERY_FACTOR <= value <= wanted * _RECOVERY_FACTOR)
    return bool(abs(value - wanted) <= _NEAR[key])


def _rule(text: str) -> Callable[[TrialFacts], bool]:
    """A test of a trial from ``KEY=VALUE``; keys are trial (with * and ?), pca, amplitude (L0) and recovery (s)."""
    key, equals, value = text.partition("=")
    if not equals or key not in ("trial", *_FACTS):
        raise UserError(
            f"rule '{text}' is not KEY=VALUE{suggest(key, ('trial', *_FACTS))}; for example pca=6.3 or trial=triangle*"
        )
    if key == "trial":
        return lambda facts: fnmatch.fnmatchcase(facts.trial, value)
    try:
        wanted = float(value)
    except ValueError:
        raise UserError(f"rule '{text}': '{value}' is not a number; for example {key}=6.3") from None
    return lambda facts: _close(key, facts, wanted)


def _there(key: str, trials: Sequence[TrialFacts]) -> str:
    """What a rule could have named: numbers with their unit, so that one in per cent is seen for what it is."""
    if key not in _FACTS:
        return f"trials are {', '.join(facts.trial for facts in trials)}"
    name, unit = _FACTS[key]
    numbers = sorted({value for facts in trials if (value := getattr(facts, name)) is not None})
    shown = ", ".join(f"{number:g}" for number in numbers)
    return f"{key} of the trials: {shown}{unit}" if numbers else f"no trial says its {key}"


def paper_training(facts: TrialFacts) -> bool:
    """Whether the paper fitted to such a trial: AMP 3.83 % with RT 0.1 s, and the stretch without any before it.

    The authors' programs (github timvanderzee/biophysical-muscle-model, Fitting) name the two.
    """
    unconditioned = facts.amplitude_l0 is None or facts.amplitude_l0 < 1e-3
    return unconditioned or (_close("amplitude", facts, 0.0383) and _close("recovery", facts, 0.1))


def held_out(
    trials: Sequence[TrialFacts], hold_out: Sequence[str], train: Sequence[str], preset: str | None
) -> list[bool]:
    """For each trial, whether it is kept out.

    Args:
        hold_out: rules ``KEY=VALUE``; a trial that meets any is kept out.
        train: rules; where there are some, a trial that meets none is kept out.
        preset: ``paper`` or None.

    Raises:
        UserError: a malformed rule, a rule that no trial meets, an unknown preset.
    """  # fmt: skip
    if preset not in (None, "paper"):
        raise UserError(f"split '{preset}' is not known; there is paper")
    for text in (*hold_out, *train):
        if not any(_rule(text)(facts) for facts in trials):
            raise UserError(f"no trial meets the rule '{text}'; {_there(text.partition('=')[0], trials)}")
    out, wanted = [_rule(text) for text in hold_out], [_rule(text) for text in train]
    return [
        any(rule(facts) for rule in out)
        or (bool(wanted) and not any(rule(facts) for rule in wanted))
        or (preset == "paper" and not paper_training(facts))
        for facts in trials
    ]
