"""How large differences between model and data are, and over how many samples one goes on into the next."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xb_muscle_ros.fit.training import Training
from xb_muscle_ros.scores.noise.residual import LEAST_SD_F0, ResidualNoise, residual_noise
from xb_muscle_ros.trials.trial import Array


class Scale(NamedTuple):
    """Size of one standard deviation of the differences.

    Attributes:
        force_sd_f0: root-mean-square of a sample's difference, F0.
        correlation_samples: integrated autocorrelation time: samples that tell as much as one independent one.
    """

    force_sd_f0: float
    correlation_samples: float


# Before anything is known: 1 % F0, and ten independent samples in a trial of 400.
FIRST = Scale(0.01, 40.0)


def noise_at(training: Training, z: Array, slopes: tuple[Array, Array]) -> ResidualNoise:
    """Noise behind the residuals at a point.

    Args:
        z: the point, on the moved scale.
        slopes: there, see `Training.slopes`.
    """
    of_force, of_features = slopes
    residual, places = training.measured - training.force(z), training.slices()
    information = training.problem.information
    means = np.array([c.prior_mean for c in training.problem.coordinates])
    return residual_noise(
        [t.force_time_s for t in training.trials],
        [residual[s] for s in places],
        [of_force[s] for s in places],
        np.diag(information) + of_features.T @ of_features,
        information * (z - means) + of_features.T @ training.feature_distance(z),
    )


def scale_of(noise: ResidualNoise) -> Scale:
    """Scale of the differences of all trials together."""
    sizes = np.array([t.size for t in noise.times_s], dtype=np.float64)
    if not sizes.size:
        return Scale(LEAST_SD_F0, 1.0)
    squares = sizes * noise.variance_f0
    # Trials with large residuals decide on the autocorrelation; each has two independent samples at least.
    lengths = [min(max(noise.autocorrelation_samples(i), 1.0), 0.5 * n) for i, n in enumerate(sizes)]
    return Scale(float(np.sqrt(np.sum(squares) / np.sum(sizes))), float(np.average(lengths, weights=squares)))
