"""Whether an explanation predicts held-out trials better: the one place that decides it."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.diagnose.crossval import HeldOut, difference
from xb_muscle_ros.diagnose.significance import FLOOR_F0

# An error that falls by less than a tenth is the same error to anyone who reads it.
LESS = 0.9


class Gain(NamedTuple):
    """What an explanation gains on held-out trials.

    Attributes:
        before_f0, after_f0: RMSD over all samples, of the base and of the explanation, F0.
        usual_before_f0, usual_after_f0: geometric mean of the trials' RMSDs, F0: no trial outweighs the others.
        trials: held out.
        delta_elpd, se: sum over trials of the logarithm of the ratio of their RMSDs, and its standard error.
        of_faults: whether the explanation has faults of the measurement only. A trial's own offset or drift is not to
            be learnt from others, so that one trial may well be predicted worse: the usual error counts.
    """

    before_f0: float
    after_f0: float
    usual_before_f0: float
    usual_after_f0: float
    trials: int
    delta_elpd: float
    se: float
    of_faults: bool

    @staticmethod
    def of(before: HeldOut, after: HeldOut, of_faults: bool) -> Gain:
        """From the scores of both."""
        apart = difference(after, before)
        usual = [
            math.exp(0.5 * float(np.mean(np.log([max(x, 1e-12) for x in s.mse.values()])))) for s in (before, after)
        ]
        return Gain(before.rmsd_f0, after.rmsd_f0, usual[0], usual[1], len(after.samples), *apart, of_faults)

    @property
    def judged(self) -> tuple[float, float]:
        """The pair of errors that counts, F0."""
        return (self.usual_before_f0, self.usual_after_f0) if self.of_faults else (self.before_f0, self.after_f0)

    @property
    def gained_f0(self) -> float:
        """Root of what the mean square loses, F0; negative where it grows."""
        before, after = self.judged
        return math.copysign(math.sqrt(abs(before**2 - after**2)), before - after)

    @property
    def beyond_error(self) -> bool:
        """Whether the gain exceeds its standard error over trials."""
        return self.delta_elpd > self.se

    @property
    def better(self) -> bool:
        """Whether trials are predicted better, by more than the standard error and than anyone would call the same."""
        before, after = self.judged
        return self.beyond_error and after <= LESS * before and self.gained_f0 >= FLOOR_F0

    @property
    def words(self) -> str:
        """What was found, and why it is no gain where it is none."""
        before, after = self.judged
        which = "usual error of a trial " if self.of_faults else ""
        text = f"{which}{100 * before:.2f} to {100 * after:.2f} % F0, {self.delta_elpd:.1f} ± {self.se:.1f}"
        if self.better:
            return text
        if self.delta_elpd <= 0.0 or after >= before:
            return f"no better: {text}"
        if not self.beyond_error:
            return f"no better: {text}, not beyond its standard error over trials"
        return f"no better: {text}, less than a tenth or less than {100 * FLOOR_F0:g} % F0 of mean square"

    def to_json(self, name: str) -> dict[str, Any]:
        """Plain data.

        Args:
            name: of the explanation.
        """
        return {
            "explanation": name,
            **self._asdict(),
            "gained_f0": self.gained_f0,
            "floor_f0": FLOOR_F0,
            "better": self.better,
        }
