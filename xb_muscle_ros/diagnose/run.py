"""A whole diagnosis: from bags to `diagnosis.json`, the augmented fibre file and the report."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.diagnose.crossval import HeldOut, folds_of, held_out
from xb_muscle_ros.diagnose.mismatch import Recordings, rmsd, simulated
from xb_muscle_ros.diagnose.names import MECHANISMS, Name, Verdict
from xb_muscle_ros.diagnose.next_experiment import Proposal, propose
from xb_muscle_ros.diagnose.notes import notes, of_effort
from xb_muscle_ros.diagnose.outcome import Outcome, write
from xb_muscle_ros.diagnose.parsimony import kept_to_what_foretells
from xb_muscle_ros.diagnose.plain import as_json
from xb_muscle_ros.diagnose.profile import known
from xb_muscle_ros.diagnose.refit import Fit
from xb_muscle_ros.diagnose.screen import Linear
from xb_muscle_ros.diagnose.search import QUICK, Effort, Search, Searcher, penalised
from xb_muscle_ros.diagnose.significance import ALPHA, Significance
from xb_muscle_ros.diagnose.study import Explanation, Study
from xb_muscle_ros.diagnose.verdict import Decision, Evidence, decide, explained
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.data import fit_trials
from xb_muscle_ros.fit.start import with_constants
from xb_muscle_ros.models.fibre_file import Fibre, changed, load_fibre
from xb_muscle_ros.scores.noise.model import Source
from xb_muscle_ros.scores.noise.trials import ENOUGH
from xb_muscle_ros.trials.completing import Known
from xb_muscle_ros.trials.study import read_study
from xb_muscle_ros.trials.trial import Trial
from xb_muscle_ros.work import Options


def diagnose_bags(
    bags: Sequence[Path],
    fiber: str | Path,
    out: Path,
    quick: bool = False,
    seed: int = 1,
    model: str | None = None,
    method: str | None = None,
    options: Options | None = None,
    report: bool = True,
    known: Known | None = None,
    only: str | None = None,
) -> dict[str, Any]:
    """Diagnose the trials of some bags and write what was found.

    Args:
        bags: bags or folders of bags, in the order of recording.
        fiber: fibre file or name: where the base model starts.
        out: folder for `diagnosis.json`, `augmented.yaml`, `report.html`, `traces.npz` and the next experiment's bag.
        quick: look less hard.
        seed: of the bootstrap.
        model, method: of the fibre file; its own where None.
        options: where work is done; finished work is kept in `out`.
        report: write the page as well.
        known: what is known of L0 and F0 beside bags and fibre file.
        only: take trials of this fibre and no other.

    Returns:
        what `diagnosis.json` holds.

    Raises:
        UserError: bags that cannot be read or do not belong together, no force, no solution at the start.
    """
    if not bags:
        raise UserError("there are no bags to diagnose; give at least one")
    fibre = load_fibre(fiber, model, method)
    trials, told = read_study(bags, fibre.name, (known or Known()).of_file(fibre), only)
    options = options or Options(processes=0, quiet=True)
    options = replace(options, journal=options.journal or out / "journal.jsonl")
    outcome = diagnose(trials, fibre, QUICK if quick else Effort(), seed, options)
    outcome = replace(outcome, warnings=(*told, *outcome.warnings))
    found = as_json(outcome, quick)
    write(out, outcome, found, report)
    return found


def diagnose(trials: Sequence[Trial], fibre: Fibre, effort: Effort, seed: int, options: Options) -> Outcome:
    """Diagnose trials of one fibre.

    Raises:
        UserError: see `diagnose_bags`.
    """
    begun = time.monotonic()
    fibres = dict.fromkeys(t.facts.fibre for t in trials)
    if len(fibres) > 1:
        raise UserError(f"trials are of fibres {', '.join(fibres)}; diagnose one fibre at a time")
    for trial in trials:
        if trial.force_n.size and not np.any(trial.force_n):
            raise UserError(
                f"trial {trial.facts.trial}: measured force is 0 N in all {trial.force_n.size} samples; check the "
                "force channel, or leave the bag out"
            )
    warnings = [w for t in trials for w in t.warnings]
    # Released sets were fitted with smooth functions; what they blur is no physics to be looked for.
    given, fibre = fibre, changed(fibre, {"smoothing": 0.0}, "diagnosis")
    # What is written carries the rest length and F0 of what was measured.
    fibre, differing = with_constants(fibre, [t.facts for t in trials])
    warnings += differing
    study = Study(fibre, fit_trials(trials, [False] * len(trials), whole=True))
    recordings = Recordings.of(trials, effort.draws, seed)
    start = Fit(Explanation(), {}, np.inf, np.inf, 0)
    measured = [t.measured_f0 for t in study.trials]
    start_forces = simulated(study, start)

    def significant(of: Study, fit: Fit) -> bool:
        found = recordings.significance(of, Linear.of(of, fit))
        return found.detected(ALPHA)

    searcher = Searcher(study, effort, options)
    search = searcher.search(significant)
    study = searcher.study
    before = recordings.significance(study, search.linear)
    detected = before.detected(ALPHA)
    folds = folds_of(study, effort.folds)

    def scored(fits: Sequence[Fit]) -> dict[str, HeldOut]:
        return held_out(study, fits, folds, max(6, effort.most // 3), options) if folds else {}

    scores = kept_to_what_foretells(search, scored)
    if detected and search.final is not search.base:
        searcher.compete(search)
    last = Linear.of(study, search.final)
    after = recordings.significance(study, last)
    wanted = _to_score(search, effort.rivals) if detected else [search.base]
    scores |= scored([f for f in wanted if f.explanation.label not in scores])
    bound = recordings.bound(study, search.linear, last, folds) if folds and detected else None
    lead = _lead(search)
    interval = known(study, search.final, lead, effort.profiled, options) if lead and detected else None
    described = _described(recordings, search, measured)
    decision = decide(
        Evidence(
            search=search,
            start_rmsd_f0=rmsd(measured, start_forces),
            noise_f0=recordings.usual_noise_f0(),
            detected=detected,
            p_value=before.overall_p,
            heldout=scores,
            bound=bound,
            interval=interval.interval if interval else None,
            at_bound=interval.at_bound if interval else False,
            cleaned=_cleaned(before, after),
            described=described,
        )
    )
    outcome = Outcome(
        trials=tuple(trials),
        study=study,
        search=search,
        recordings=recordings,
        before=before,
        after=after,
        last=last,
        heldout=scores,
        bound=bound,
        conflicts=tuple(recordings.conflicts(study, search.linear)) if detected else (),
        law=recordings.law(study, search.linear) if detected else None,
        known=interval,
        decision=decision,
        proposal=_proposal(search, decision, trials),
        start_forces=start_forces,
        warnings=tuple(warnings),
        missing=tuple(_missing(recordings, search, folds, measured, decision)),
        seconds=time.monotonic() - begun,
        seed=seed,
        described=described,
    )
    lines = [*of_effort(effort, Effort(), len(trials)), *notes(given, trials, recordings, search, outcome.shown)]
    return replace(outcome, notes=tuple(lines))


def _to_score(search: Search, rivals: int) -> list[Fit]:
    """Fits whose held-out scores are worth knowing: base, final and the final's best rivals."""
    found = {search.base.explanation.label: search.base, search.final.explanation.label: search.final}
    for name in search.final.explanation.names:
        for fit in search.rivals(name)[:rivals]:
            found.setdefault(fit.explanation.label, fit)
    if not search.final.explanation.names:
        for fit in sorted(search.fits.values(), key=penalised)[:rivals]:
            found.setdefault(fit.explanation.label, fit)
    return list(found.values())


def _lead(search: Search) -> Name | None:
    """The mechanism without which the final explanation would lose most."""

    def rise(name: Name) -> float:
        without = search.fits.get(search.final.explanation.without(name).label, search.base)
        return without.cost - search.final.cost

    return max(search.final.explanation.mechanisms, key=rise, default=None)


def _cleaned(before: Significance, after: Significance) -> float:
    """Share of the located cells' mean square that is gone, beyond what noise leaves there."""
    counted = before.counts(ALPHA)
    if not np.any(counted):
        counted = before.rms_f0 >= np.max(before.rms_f0)
    sizes = np.array([cell.end - cell.begin for cell in before.cells], dtype=np.float64)
    was, now = (float(np.sum((s.rms_f0**2 * sizes)[counted])) for s in (before, after))
    return 1.0 - now / was if was > 0.0 else 0.0


def _proposal(search: Search, decision: Decision, trials: Sequence[Trial]) -> Proposal | None:
    """What would tell the answer from its nearest rival, or from having none."""
    pcas = sorted({t.facts.pca for t in trials if t.facts.pca is not None})
    chosen = sorted({pcas[0], pcas[len(pcas) // 2], pcas[-1]}) if pcas else [6.2]
    order = sorted(search.fits.values(), key=penalised)
    of_mechanisms = [f for f in order if any(n in MECHANISMS for n in f.explanation.names)]
    first = search.final if search.final.explanation.mechanisms else next(iter(of_mechanisms), None)
    if first is None:
        return None
    # The same mechanisms in another order are no rival.
    own = set(first.explanation.mechanisms)
    others = [f for f in of_mechanisms if set(f.explanation.mechanisms) != own]
    ties = [f for f in others if set(f.explanation.names) & set(decision.ties)]
    second = next(iter([*ties, *others]), search.base)
    return propose(search.study, first, second, chosen)


# More noise than this hides what is looked for, F0; an explanation that leaves more than this share of the force's
# standard deviation does not describe the recordings.
_NOISY_F0, _UNDESCRIBED = 0.02, 0.5


def _described(recordings: Recordings, search: Search, measured: Sequence[Any]) -> bool:
    """Whether there is anything to build on."""
    spread = float(np.std(np.concatenate(list(measured))))
    return recordings.usual_noise_f0() <= _NOISY_F0 and search.final.rmsd_f0 <= _UNDESCRIBED * spread


def _missing(
    recordings: Recordings,
    search: Search,
    folds: Sequence[frozenset[str]],
    measured: Sequence[Any],
    decision: Decision,
) -> list[str]:
    """What a firmer answer would need, a line each."""
    lines = []
    if decision.verdict is Verdict.UNEXPLAINED and search.final.explanation.names:
        share = explained(search.base, search.final, recordings.usual_noise_f0())
        lines.append(
            f"an explanation that goes further: of those tried, {search.final.explanation.label} takes "
            f"{100 * share:.0f} % off the mismatch's mean square, which is not enough to name it"
        )
    if not folds:
        lines.append("at least three trials, so that some can be held out: without that no mechanism is named")
    told = sum(of_trial.samples for of_trial in recordings.noise.trials)
    if decision.verdict is Verdict.UNEXPLAINED and not decision.checks and told < ENOUGH:
        lines.append(
            f"a longer time without movement in some trials: what is left, {100 * search.base.rmsd_f0:.1f} % F0, is "
            "not to be told from noise of which so few samples are known"
        )
    noise = recordings.usual_noise_f0()
    if noise > _NOISY_F0:
        lines.append(f"force with less noise: {100 * noise:.1f} % F0 hides what is looked for")
    if any(of_trial.source is Source.CURVE for of_trial in recordings.noise.trials):
        lines.append(
            f"{ENOUGH} evenly spaced samples of force or more while nothing moves: noise was taken from what smooth "
            "curves leave of force, which shows none that is as slow as these"
        )
    spread = float(np.std(np.concatenate(list(measured))))
    if search.final.rmsd_f0 > _UNDESCRIBED * spread:
        lines.append(
            "recordings that the model describes at all: after the fit half of the force's variation is left; check "
            "that channels, units, calcium and fibre belong together"
        )
    if all(t.facts.pca is None or t.facts.pca < 8.0 for t in recordings.trials):
        lines.append("a trial without calcium (pCa 9), which tells passive from active effects")
    return lines
