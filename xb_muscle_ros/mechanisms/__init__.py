"""Blocks of physics: what a file with a mechanism imports stands here."""

from xb_muscle_ros.mechanisms import ops
from xb_muscle_ros.mechanisms.base import (
    ExponentialRate,
    Family,
    GaussianSpread,
    Mechanism,
    Parameter,
    State,
    StepRate,
    StrainRate,
    Values,
)
from xb_muscle_ros.mechanisms.entry import Entry, Starts
from xb_muscle_ros.mechanisms.extra import Chain, Extra, InSeries, Moments, Needs, Unit
from xb_muscle_ros.mechanisms.families import (
    Activation,
    Attachment,
    Balance,
    Contractile,
    Detachment,
    ForceVelocity,
    Parallel,
    Series,
    ThickFilament,
    ThinFilament,
)
from xb_muscle_ros.mechanisms.ops import Expr
from xb_muscle_ros.mechanisms.quantities import Quantities

__all__ = [
    "Activation", "Attachment", "Balance", "Chain", "Contractile", "Detachment", "Entry", "ExponentialRate", "Expr",
    "Extra", "Family", "ForceVelocity", "GaussianSpread", "InSeries", "Mechanism", "Moments", "Needs", "Parallel",
    "Parameter", "Quantities", "Series", "Starts", "State", "StepRate", "StrainRate", "ThickFilament", "ThinFilament",
    "Unit", "Values", "ops",
]  # fmt: skip
