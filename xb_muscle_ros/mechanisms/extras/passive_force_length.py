"""Passive force-length relation of the half-sarcomeres, in series with the series element."""

from xb_muscle_ros.mechanisms import Expr, Extra, Needs, Parameter, Quantities, ops
from xb_muscle_ros.mechanisms.extras.active_force_length import FL_MAX, FL_OPTIMUM

FP_MAX = Parameter(
    "fp_max", "F0", "passive force of half-sarcomeres three quarters of the way from their optimum to fl_max", 0.0,
    100.0, 1.3, "MuJoCo 3, mju_muscleBias (fpmax)",
)  # fmt: skip

FP_ONSET = Parameter(
    "fp_onset", "L0", "length of half-sarcomeres beyond their optimum where passive force begins", -0.7, 1.0, 0.0,
    "MuJoCo 3, mju_muscleBias: at the optimum",
)  # fmt: skip


class PassiveForceLength(Extra):
    """F = fp_max (w²/2 + (y - 1)+) with w = min(y, 1): a parabola up to y = 1, then its tangent.

    y is 2 (L - 1 - fp_onset)+/(fl_max - 1), with L = 1 + ΔS - fl_optimum and ΔS the half-sarcomeres' length change.
    Beside the heads and within the half-sarcomeres, it stretches the series element as they do. The curve is that of
    MuJoCo's engine, which has 1.5 fp_max at fl_max. An onset of its own is for muscles on a spring, whose optimum is
    where they pull hard and whose passive force begins where nothing pulls.
    """

    name = "passive_force_length"
    needs = Needs.SEPARATE_LENGTHS
    geometry = True
    parameters = (FP_MAX, FP_ONSET, FL_MAX, FL_OPTIMUM)

    def inner_force(self, q: Quantities) -> Expr:
        _, w, beyond = self._stretch(q)
        return q.fp_max / q.Fscale * (w**2 / 2 + beyond)

    def inner_kinetics(self, q: Quantities) -> tuple[Expr, Expr]:
        per_length, w, _ = self._stretch(q)
        return 0, q.fp_max / q.Fscale * w * per_length / q.gamma

    def _stretch(self, q: Quantities) -> tuple[Expr, Expr, Expr]:
        """Of y: its change per L0, its part up to 1, and what is beyond."""
        per_length = 2 / (q.fl_max - 1)
        y = per_length * ops.positive(q.sarcomere_change - q.fl_optimum - q.fp_onset)
        beyond = ops.positive(y - 1)
        return per_length, y - beyond, beyond
