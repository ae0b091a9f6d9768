"""A study from trials to judged sets: noise, base, the Gaussian form's own error, search, held-out predictions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from xb_muscle_ros.diagnose.effort import Effort
from xb_muscle_ros.diagnose.inference.answer import Judged
from xb_muscle_ros.diagnose.inference.heldout import HeldOut
from xb_muscle_ros.diagnose.intake import FibreStudy
from xb_muscle_ros.diagnose.noise.closure import closure_error
from xb_muscle_ros.diagnose.noise.residuals import Around, Recordings
from xb_muscle_ros.diagnose.noise.significance import FLOOR_F0, Significance
from xb_muscle_ros.diagnose.search.compiling import compile_first
from xb_muscle_ros.diagnose.search.explore import Explorer
from xb_muscle_ros.diagnose.search.system import Names, System
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.data import fit_trials
from xb_muscle_ros.fit.features import Feature
from xb_muscle_ros.fit.start import with_constants
from xb_muscle_ros.models.fibre_file import Fibre, changed
from xb_muscle_ros.scores.noise.trials import noise_of
from xb_muscle_ros.work import Options


@dataclass(frozen=True)
class BaseFitted:
    """A study before its search: the base is fitted, and the Gaussian form's own error taken out.

    Attributes:
        fibres: as the search starts from them: smoothing off, constants of the trials.
        recorded: all samples of each fibre.
        recordings: trials of each fibre with their noise.
    """

    studies: tuple[FibreStudy, ...]
    fibres: tuple[Fibre, ...]
    recorded: tuple[System, ...]
    recordings: tuple[Recordings, ...]
    explorer: Explorer
    lines: tuple[str, ...]

    def around(self, names: Names, i: int) -> Around:
        """A set's fit in one fibre, at all samples."""
        explorer = self.explorer
        return Around.of(self.recorded[i], explorer.fits[names][i], explorer.systems[i].effective_samples)

    def significance(self) -> tuple[Significance, ...]:
        """Of the base's residual in each fibre."""
        return tuple(r.significance(self.around((), i)) for i, r in enumerate(self.recordings))

    def fibre_with(self, names: Names, i: int) -> Fibre:
        """A fitted fibre in the whole model."""
        problem = self.recorded[i].problem(names, self.explorer.fits[names][i].values)
        return problem.fibre_at(problem.start)


@dataclass(frozen=True)
class Searched(BaseFitted):
    """A study, searched, with the significance of the base's residual in each fibre."""

    judged: Judged
    base: tuple[Significance, ...]


def fit_base(
    studies: Sequence[FibreStudy],
    effort: Effort,
    seed: int,
    options: Options,
    features: Mapping[str, tuple[Feature, ...]] = MappingProxyType({}),
    error_sds: Mapping[str, float] = MappingProxyType({}),
) -> BaseFitted:
    """Fit the base of a study; arguments as of `run.diagnose`.

    Args:
        features: to be met beside the traces, by fibre.
        error_sds: of ordinary measurement errors, in place of those of `measurement.artefacts.ARTEFACTS`.

    Raises:
        UserError: no solution at the start.
    """
    lines, fibres, recorded, recordings, systems = [], [], [], [], []
    for study in studies:
        # Released sets were fitted with smooth functions; what they blur is no physics to be looked for.
        fibre, differing = with_constants(
            changed(study.fibre, {"smoothing": 0.0}, "diagnosis"), [t.facts for t in study.trials]
        )
        lines += differing
        trials = fit_trials(study.trials, [False] * len(study.trials), whole=True)
        recording = Recordings(study.trials, noise_of(study.trials), effort.draws, seed)
        floor = max(FLOOR_F0, recording.usual_noise_f0())
        systems.append(
            replace(System.of(fibre, trials, floor), features=features.get(fibre.name, ()), error_sds=error_sds)
        )
        weights = np.ones(sum(t.measured_f0.size for t in trials))
        recorded.append(System(fibre, trials, weights, floor, error_sds=error_sds))
        fibres.append(fibre)
        recordings.append(recording)
    compile_first(fibres, options)
    # A fit takes a fraction of a second, less than to start the processes that would share the work.
    if options.scheduler is None and options.processes is None:
        options = replace(options, processes=0)
    explorer = Explorer(systems, effort, options)
    explorer.base()
    made = BaseFitted(tuple(studies), tuple(fibres), tuple(recorded), tuple(recordings), explorer, tuple(lines))
    if any(found.detected() for found in made.significance()):
        made = replace(made, recorded=tuple(_closed(explorer, recorded)))
    return made


def search(study: BaseFitted) -> Searched:
    """Search a study whose base is fitted.

    Raises:
        UserError: no solution with all that has evidence, or a force that cannot be looked at.
    """
    explorer = study.explorer
    explorer.explore()
    if any(s.closure_f0 for s in explorer.systems) and _does_without(explorer):
        study = replace(study, recorded=tuple(replace(s, closure_f0={}) for s in study.recorded))
        explorer.anew([replace(s, closure_f0={}) for s in explorer.systems])
        explorer.explore()
    heldout = HeldOut(explorer, study.recorded)
    judged = Judged.of(explorer, heldout, [r.usual_noise_f0() for r in study.recordings])
    _predict(judged)
    return Searched(**study.__dict__, judged=judged, base=study.significance())


def _closed(explorer: Explorer, recorded: Sequence[System]) -> list[System]:
    """With the Gaussian form's own error at the base's fit; the base is fitted anew."""
    full, thin = [], []
    for i, (system, every) in enumerate(zip(explorer.systems, recorded, strict=True)):
        fit = explorer.fits[()][i]
        closure = closure_error(every.problem((), fit.values), system.fibre)
        kept = {t.name: np.isin(t.time_s, s.time_s) for t, s in zip(every.trials, system.trials, strict=True)}
        full.append(replace(every, closure_f0=closure))
        thin.append(replace(system, closure_f0={name: values[kept[name]] for name, values in closure.items()}))
    if any(s.closure_f0 for s in thin):
        explorer.anew(thin)
    return full


def _does_without(explorer: Explorer) -> bool:
    """Whether the best set does as well without the Gaussian form's own error taken out.

    Recordings that a Gaussian form made, say, do not have that error, and part of what was found only puts it back.
    """
    best = explorer.best()
    plain = Explorer([replace(s, closure_f0={}) for s in explorer.systems], explorer.effort, explorer.options)
    plain.fit([(best, explorer.ends(best))], "without closure")
    if best not in plain.fits:
        return False
    pairs = zip(explorer.systems, explorer.fits[best], plain.fits[best], strict=True)
    return all(after.cost(s) < before.cost(s) and after.rmsd_f0 < s.noise_f0 for s, before, after in pairs)


def _predict(judged: Judged) -> None:
    """Held-out predictions of base, answer, and answer without each of its names."""
    explorer, chosen = judged.explorer, judged.chosen
    nearest = min(explorer.fits, key=lambda s: len(set(s) ^ set(chosen)))
    explorer.fit([(chosen, explorer.ends(nearest))], "answer")
    if chosen not in explorer.fits:
        raise UserError(
            f"fibre {explorer.systems[0].fibre.name}: the model has no solution with all that has "
            "evidence; give more trials"
        )
    shorter = explorer.shorter(chosen, "answer but one")
    if judged.heldout:
        judged.heldout.predict([(), chosen, *shorter])
