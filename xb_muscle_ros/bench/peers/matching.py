"""What is made equal before muscles are compared: isometric force, and where asked for the unconditioned stretch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, least_squares

from xb_muscle_ros.bench.peers.conditions import onset_stiffness, path_of
from xb_muscle_ros.bench.peers.muscle import Peer, PeerMuscle
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.scores.conditions import CONDITIONS
from xb_muscle_ros.trials.trial import Array

# The reference trial: nothing goes before its test stretch.
_UNCONDITIONED = path_of(CONDITIONS[0])
_SMALL_F0 = 1e-7
# Starts of a fit as shares of the way between the bounds, as many as there are parameters.
_STARTS = (0.6, 0.3)


@dataclass(frozen=True)
class Target:
    """What was measured of one fibre, shape (pca,); NaN where it was not.

    Attributes:
        isometric_f0: F0.
        unconditioned: SRS of stretches that nothing went before, F0/L0.
    """

    isometric_f0: Array
    unconditioned: Array


def activation_for(muscle: PeerMuscle, isometric_f0: float) -> float:
    """Activation that gives an isometric force (F0); the nearest allowed one where none does."""
    low, high = muscle.least_activation, 1.0
    if muscle.isometric_f0(low) >= isometric_f0:
        return low
    if muscle.isometric_f0(high) <= isometric_f0:
        return high
    return float(brentq(lambda a: muscle.isometric_f0(a) - isometric_f0, low, high, xtol=_SMALL_F0))


def activations(muscle: PeerMuscle, target: Target) -> Array:
    """Activation at each pCa, shape (pca,); NaN where no isometric force was measured."""
    return np.array([activation_for(muscle, f) if np.isfinite(f) else np.nan for f in target.isometric_f0])


def unconditioned_srs(muscle: PeerMuscle, at: Array) -> Array:
    """SRS of an unconditioned stretch at activations of shape (pca,), F0/L0; NaN where an activation is."""
    return np.array(
        [
            onset_stiffness(_UNCONDITIONED, muscle.force_f0(float(a), _UNCONDITIONED)) if np.isfinite(a) else np.nan
            for a in at
        ]
    )


def fitted(peer: Peer, target: Target) -> dict[str, float]:
    """A peer's free parameters for one fibre: least squares to the measured SRS of the unconditioned stretch.

    Isometric force is matched anew for every value tried. Parameters are searched on a logarithmic scale from several
    starts, because force rises steeply and then falls with the stiffness of a tendon: a stiff one lets the
    contractile element take the stretch.

    Raises:
        UserError: nothing was measured to fit to, or the muscle cannot be integrated at any start.
    """
    if not peer.free:
        return {}
    known = np.isfinite(target.isometric_f0) & np.isfinite(target.unconditioned)
    if np.count_nonzero(known) < len(peer.free):
        raise UserError(
            f"{peer.title}: SRS of the unconditioned stretch is known at {np.count_nonzero(known)} pCa; "
            f"{len(peer.free)} are needed to fit {peer.fitted}"
        )
    measured = Target(target.isometric_f0[known], target.unconditioned[known])

    def residuals(x: Array) -> Array:
        muscle = peer.take(_values(peer, x))
        found: Array = unconditioned_srs(muscle, activations(muscle, measured)) - measured.unconditioned
        return found

    bounds = np.log([[free.lower for free in peer.free], [free.upper for free in peer.free]])
    best, problem = None, ""
    for share in _STARTS[: len(peer.free)]:
        start = bounds[0] + share * (bounds[1] - bounds[0])
        try:
            # The stubs name a module so.
            one = least_squares(  # type: ignore[operator]  # SciPy has no types
                residuals, start, bounds=bounds, diff_step=3e-3, xtol=1e-4, ftol=1e-5, max_nfev=30
            )
        except UserError as error:
            problem = str(error)
            continue
        if best is None or one.cost < best.cost:
            best = one
    if best is None:
        raise UserError(f"{peer.title}: {peer.fitted} cannot be fitted: {problem}")
    return _values(peer, best.x)


def at_bound(peer: Peer, values: Mapping[str, float]) -> list[str]:
    """Names of fitted parameters that ended within 1 % of a bound."""
    return [free.name for free in peer.free if not 1.01 * free.lower < values[free.name] < free.upper / 1.01]


def _values(peer: Peer, x: Array) -> dict[str, float]:
    return {free.name: float(np.exp(value)) for free, value in zip(peer.free, x, strict=True)}
