"""A fit by direct collocation, the paper's method, with CasADi and IPOPT: to be held against our own.

The states at every sample are unknowns beside the parameters; trapezoids from sample to sample are the constraints, and
a fibre at rest at the first. So do the authors' programs (github timvanderzee/biophysical-muscle-model, Fitting), with
exact second derivatives and MUMPS; they have mean and variance of the heads' strain and the contractile element's
velocity as further unknowns, and 3 s of every trial rather than the part that counts.

What IPOPT asks for is put together from blocks of one sample each. Left to find the pattern of the derivatives by
itself, CasADi took one to three minutes to build what takes two seconds here.
"""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
import numpy.typing as npt
import sympy

from xb_muscle_ros.bench.sparse_blocks import Block, Indices, ipopt
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.models.codegen import moving_rates
from xb_muscle_ros.models.composition import Composition
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.registry import compose

Array = npt.NDArray[np.float64]

# Cost in IPOPT's eyes: 1 for a misfit of 10 % F0 in one sample. The authors' weight.
_WEIGHT = 100.0
_OPTIONS = {
    "print_time": False,
    "show_eval_warnings": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.linear_solver": "mumps",
    "ipopt.max_iter": 500,
    # The start is a simulation already: it must not be pushed off bounds that it is close to.
    "ipopt.mu_strategy": "monotone",
    "ipopt.mu_init": 1e-4,
    "ipopt.bound_push": 1e-9,
    "ipopt.bound_frac": 1e-9,
}
# The models' own functions (see symbolic.symbols); CasADi differentiates them by itself.
_FUNCTIONS = {
    "Decay": lambda z, k: ca.exp(-ca.fabs(k * z)),
    "Softplus": lambda z, k, decay: ca.fmax(z, 0) + ca.log1p(decay) / k,
    "Positive": lambda z: ca.fmax(z, 0),
    "HyperbolicTangent": ca.tanh,
    "Deviation": lambda v: ca.sqrt((v + ca.sqrt(v**2 + 4e-12)) / 2),
}


class Collocated(NamedTuple):
    """What IPOPT found.

    Attributes:
        z: the point, on the moved scale of the problem's coordinates.
        force_f0: force of its states at the samples of all trials, F0.
        iterations: of IPOPT.
        status: IPOPT's word for how it ended.
        converged: whether it ended at an optimum.
        build_s: time to build the optimisation problem, its start included.
        solve_s: time in IPOPT.
    """

    z: Array
    force_f0: Array
    iterations: int
    status: str
    converged: bool
    build_s: float
    solve_s: float


def collocate(problem: Problem, limited_memory: bool = False, limit_s: float = 300.0) -> Collocated:
    """Minimise the squared differences between force and data over parameters and states at once.

    Args:
        problem: trials with force at every sample, and model parameters as coordinates. Priors, weights and
            measurement artefacts are left out.
        limited_memory: second derivatives by limited memory (L-BFGS) instead of exact ones.
        limit_s: when to stop IPOPT, s.

    Raises:
        UserError: a model whose states are not moments (strain grids, Hill), or none at rest at the start.
    """
    begin = time.perf_counter()
    model = compose(problem.fibre.model, problem.fibre.method)
    if problem.fibre.method != "gaussian" or not isinstance(model, Composition):
        raise UserError(
            f"model {problem.fibre.model}, method {problem.fibre.method}: collocation is there for models of "
            "cross-bridges in the Gaussian form; choose one of them, such as 3state_coop"
        )
    start, lower, upper = _start(problem), *_bounds(problem)
    options = {**_OPTIONS, "ipopt.max_wall_time": limit_s}
    moved = len(problem.coordinates)
    solver = ipopt(_blocks(problem, model), start.size, start.size - moved, not limited_memory, options)
    built = time.perf_counter()
    found = np.array(solver(x0=start, lbx=lower, ubx=upper, lbg=0.0, ubg=0.0)["x"]).ravel()
    solved = time.perf_counter()
    told = solver.stats()
    z = found[:moved]
    force = _force(problem, z, found[moved:])
    status = str(told["return_status"])
    return Collocated(z, force, int(told["iter_count"]), status, bool(told["success"]), built - begin, solved - built)


def _start(problem: Problem) -> Array:
    """Parameters, and the states of a simulation with them, sample by sample."""
    muscle = Muscle(problem.fibre_at(problem.start))
    parts = [problem.start]
    for trial in problem.trials:
        rest = muscle.settle(float(trial.length_l0[0]), float(trial.calcium_um[0]))
        parts.append(muscle.run(rest, trial.dt_s, trial.length_l0, trial.calcium_um)[:, :-3].ravel())
    return np.concatenate(parts)


def _bounds(problem: Problem) -> tuple[Array, Array]:
    """Bounds of all unknowns: without those of the states, IPOPT gets lost from every second start."""
    states = compose(problem.fibre.model, problem.fibre.method).states
    smoothing = problem.fibre.values["smoothing"]
    room = [s.blur / smoothing if smoothing else 0.0 for s in states]
    samples = sum(t.time_s.size for t in problem.trials)
    lower, upper = problem.bounds
    lowest = np.tile([s.lower - r for s, r in zip(states, room, strict=True)], samples)
    highest = np.tile([s.upper + r for s, r in zip(states, room, strict=True)], samples)
    return np.concatenate([lower, lowest]), np.concatenate([upper, highest])


def _force(problem: Problem, z: Array, states: Array) -> Array:
    """Force of states at all samples, F0."""
    muscle = Muscle(problem.fibre_at(z))
    length = np.concatenate([t.length_l0 for t in problem.trials])
    calcium = np.concatenate([t.calcium_um for t in problem.trials])
    full = np.column_stack([states.reshape(length.size, -1), length, np.zeros_like(length), calcium])
    return muscle.outputs_of(full)["force_f0"]


def _blocks(problem: Problem, model: Composition) -> list[Block]:
    """Rest at the first sample of every trial, a trapezoid for each step, and the differences at all samples."""
    n, moved = len(model.states), len(problem.coordinates)
    z, inputs = ca.SX.sym("z", moved), ca.SX.sym("inputs", 5)
    length, velocity, calcium, dt, measured = ca.vertsplit(inputs)
    of_model = _model(problem, model, z)
    before, after = ca.SX.sym("before", n), ca.SX.sym("after", n)
    resting, force = of_model(after, length, velocity, calcium)
    leaving, _ = of_model(before, length, velocity, calcium)
    trapezoid = after - before - dt / 2 * (leaving + resting)

    sizes = [t.time_s.size for t in problem.trials]
    first = np.cumsum([0, *sizes[:-1]])
    later = np.setdiff1d(np.arange(sum(sizes)), first)
    values = np.concatenate([_inputs(t) for t in problem.trials], axis=1)

    def states(samples: Indices) -> Indices:
        return n * samples + np.arange(n)[:, None]

    def block(unknowns: Any, constraints: Any, samples: Indices, earlier: list[Indices]) -> Block:
        parameters = np.tile(np.arange(moved)[:, None], samples.size)
        where = np.vstack([parameters, *(moved + states(s) for s in (*earlier, samples))])
        difference = _WEIGHT**0.5 * (force - measured)
        return Block(unknowns, inputs, constraints, difference, where, states(samples), values[:, samples])

    return [
        block(ca.vertcat(z, after), resting, first, []),
        block(ca.vertcat(z, before, after), trapezoid, later, [later - 1]),
    ]


def _inputs(trial: Any) -> Array:
    """Length, velocity and calcium of the step that ends at each sample, its duration, and the force measured there."""
    velocity = np.diff(trial.length_l0) / trial.dt_s
    return np.vstack(
        [
            trial.length_l0,
            np.concatenate([[0.0], velocity]),
            trial.calcium_um,
            np.concatenate([[0.0], trial.dt_s]),
            trial.measured_f0,
        ]
    )


def _model(problem: Problem, model: Composition, z: Any) -> Any:
    """Rates of the states and force in CasADi's symbols, from states, length change, velocity and calcium."""
    e = model.equations(problem.fibre.values["smoothing"] > 0.0)
    moved = {c.name: ca.exp(z[i]) if c.log else z[i] for i, c in enumerate(problem.coordinates)}
    moved |= {tied: moved.get(source, problem.fibre.values[source]) for tied, source in problem.ties.items()}
    parameters = [moved.get(p.name, problem.fibre.values[p.name]) for p in e.parameters]
    names = [[s.name for s in e.states], ["length_change", "velocity", "calcium"], [p.name for p in e.parameters]]
    symbols = [[e.symbols[name] for name in group] for group in names]
    compute = sympy.lambdify(symbols, [*moving_rates(e), e.outputs[0]], modules=[_FUNCTIONS, ca], cse=True)

    def at(states: Any, length: Any, velocity: Any, calcium: Any) -> tuple[Any, Any]:
        *rates, force = compute(ca.vertsplit(states), [length, velocity, calcium], parameters)
        return ca.vertcat(*rates), force

    return at
