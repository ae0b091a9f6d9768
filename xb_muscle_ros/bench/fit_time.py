"""The paper's fit: ours beside direct collocation on the same made data, from the same starts.

Two protocols (AMP 3.83 % L0 with RT 0.1 s, and the unconditioned stretch) at six pCa, force from 0.0843 s before the
first stretch to 0.0843 s after the test stretch at 1 kHz, all parameters that the paper fitted; no priors and no
measurement artefacts, so that both make the same sum of squares small. The data are the fibre's own force and noise as
slow as that of real recordings; the starts are the released sets of the other fibres.
"""

from __future__ import annotations

import importlib.util
import math
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from xb_muscle_ros.bench.batch_time import FIBRES
from xb_muscle_ros.bench.measure import Figure, Setting
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.coordinates import Choice, parameter_coordinates
from xb_muscle_ros.fit.data import fit_trials
from xb_muscle_ros.fit.noise import FIRST
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.solve import Objective, descend
from xb_muscle_ros.fit.training import Training
from xb_muscle_ros.models.fibre_file import Fibre, load_fibre
from xb_muscle_ros.models.muscle import Array, Muscle
from xb_muscle_ros.progress import Progress
from xb_muscle_ros.scores.rmsd import MARGIN_S
from xb_muscle_ros.simulation.made import made
from xb_muscle_ros.trials.protocol import StretchShortenStretch

PCAS = (4.5, 6.1, 6.2, 6.3, 6.4, 6.6)
# AMP (L0) and RT (s).
PROTOCOLS = ((0.0383, 0.1), (0.0, 0.0))
_LIMIT_S = 120.0
_ASKED = "20 s were asked for"
MISSING = "fit study: CasADi is not installed, so collocation is left out; type: pip install 'xb_muscle_ros[casadi]'"


@dataclass(frozen=True)
class Outcome:
    """Where a method ended, and after what.

    Attributes:
        seconds: from data and start to parameters; compiling our model, done once on a machine, is not counted.
        z: the point, on the moved scale.
        rmsd_f0: between the data and the simulation at the point; infinite where there is none.
        converged: whether the method ended by itself.
        effort: what it took, in words.
    """

    seconds: float
    z: Array
    rmsd_f0: float
    converged: bool
    effort: str


def made_problem(
    truth: Fibre, start: Fibre, pcas: Sequence[float] = PCAS, free: Sequence[str] | None = None
) -> Problem:
    """The fit's problem on made data.

    Args:
        truth: the fibre that gave the data.
        start: where the parameters start; those that are not free have the values of `truth`.
        pcas: of the trials, two each.
        free: parameters to fit; None: those of the paper.
    """
    random = np.random.default_rng(1)
    muscle = Muscle(truth)
    trials = [
        made(muscle, StretchShortenStretch(amplitude, recovery, MARGIN_S, MARGIN_S).trial(truth.name, pca), random)
        for pca in pcas
        for amplitude, recovery in PROTOCOLS
    ]
    moved = [c.name for c in parameter_coordinates(truth, free, (), {}, {})]
    values = {**truth.values, **{name: start.values[name] for name in moved}}
    begin = replace(truth, values=MappingProxyType(values))
    no_prior = {name: Choice(prior_sd=math.inf) for name in moved}
    coordinates = parameter_coordinates(begin, moved, (), {}, no_prior)
    return Problem(begin, fit_trials(trials, [False] * len(trials)), coordinates, {})


def least_squares(problem: Problem) -> Outcome:
    """Our fit: one descent."""
    begin = time.perf_counter()
    found = descend(Objective(Training(problem), FIRST), problem.start)
    seconds = time.perf_counter() - begin
    return Outcome(seconds, found.z, found.rmsd_f0, found.converged, f"{found.evaluations} evaluations")


def collocation(problem: Problem, limited_memory: bool = False) -> Outcome:
    """Direct collocation.

    Raises:
        ImportError: CasADi is not installed.
        UserError: see `collocation.collocate`.
    """
    from xb_muscle_ros.bench.collocation import collocate

    found = collocate(problem, limited_memory, _LIMIT_S)
    training = Training(problem)
    own = _rms(found.force_f0 - training.measured)
    effort = (
        f"{found.build_s:.1f} s to build, {found.solve_s:.1f} s and {found.iterations} iterations in IPOPT, "
        f"{100.0 * own:.4f} % F0 by its own states"
    )
    try:
        rmsd = _rms(training.force(found.z) - training.measured)
    except UserError:
        rmsd = math.inf
    if not found.converged:
        effort += f", {found.status}"
    return Outcome(found.build_s + found.solve_s, found.z, rmsd, found.converged, effort)


def _rms(difference: Array) -> float:
    return float(np.sqrt(np.mean(difference**2)))


def study(setting: Setting) -> list[Figure]:
    """One fit from each other fibre's released set by our method and, where CasADi is installed, by collocation."""
    truth = setting.fibre
    problems = {}
    for name in FIBRES:
        if name != truth.name:
            problems[name] = made_problem(truth, load_fibre(name, truth.model, truth.method))
    methods: dict[str, Callable[[Problem], Outcome]] = {"least squares": least_squares}
    if importlib.util.find_spec("casadi") is None:
        Progress.write(f"xb_muscle: warning: {MISSING}", file=sys.stderr)
    else:
        methods["collocation"] = collocation
    outcomes: dict[str, dict[str, Outcome]] = {method: {} for method in methods}
    first, *_ = problems
    # Compile and load before the clock runs.
    Training(problems[first]).force(problems[first].start)
    with Progress(len(problems) * len(methods) + len(methods) - 1, "fits") as progress:
        for name, problem in problems.items():
            for method, fit in methods.items():
                outcomes[method][name] = fit(problem)
                progress.update()
        made = _figures(truth, outcomes, problems)
        if "collocation" in methods:
            found = collocation(problems[first], limited_memory=True)
            title = f"fit, {truth.name} from {first}, collocation, limited memory"
            made.append(Figure(title, found.seconds, "s", _what(found, _errors(problems[first], found, truth))))
            progress.update()
    return made


def _figures(truth: Fibre, outcomes: dict[str, dict[str, Outcome]], problems: dict[str, Problem]) -> list[Figure]:
    made = []
    best = min(outcome.rmsd_f0 for found in outcomes.values() for outcome in found.values())
    for method, found in outcomes.items():
        for name, outcome in found.items():
            title = f"fit, {truth.name} from {name}, {method}"
            what = _what(outcome, _errors(problems[name], outcome, truth))
            made.append(Figure(title, outcome.seconds, "s", what))
    for method, found in outcomes.items():
        there = sum(outcome.rmsd_f0 < 1.01 * best for outcome in found.values())
        low, middle, high = np.percentile([outcome.seconds for outcome in found.values()], [25, 50, 75])
        longest = max(outcome.seconds for outcome in found.values())
        what = f"{there} of {len(found)} starts end at the best point; longest {longest:.1f} s; {_ASKED}"
        made.append(Figure(f"fit, {truth.name}, {method}, median", middle, "s", what, (high - low) / 2.0))
    return made


def _errors(problem: Problem, outcome: Outcome, truth: Fibre) -> dict[str, float]:
    """Relative errors of the parameters."""
    values = problem.fibre_at(outcome.z).values
    return {c.name: abs(values[c.name] / truth.values[c.name] - 1.0) for c in problem.coordinates}


def _what(outcome: Outcome, errors: dict[str, float]) -> str:
    worst = max(errors, key=errors.__getitem__)
    end = "" if outcome.converged else "not converged; "
    return (
        f"{end}{outcome.effort}; simulated RMSD {100.0 * outcome.rmsd_f0:.4f} % F0; "
        f"parameters within {100.0 * errors[worst]:.2g} % ({worst})"
    )
