"""Length-dependent activation: a longer fibre is more sensitive to calcium."""

from xb_muscle_ros.mechanisms import Entry, Extra, Parameter, Quantities, Values, ops

SENSITIVITY = Parameter(
    "calcium_per_length", "1/L0", "relative rise of calcium sensitivity with length", -50.0, 50.0, 0.0,
    "Stephenson and Williams 1982; this package",
)  # fmt: skip


class LengthDependentActivation(Extra):
    """The thin filament sees Ca exp(alpha ΔL): pCa50 rises by alpha/ln 10 per L0."""

    name = "length_dependent_activation"
    parameters = (SENSITIVITY,)
    entry = Entry(
        "length_dependence", "length-dependent activation", "a longer fibre is more sensitive to calcium",
        "calcium_per_length", 3.0, starts=({"calcium_per_length": 1.5},),
    )  # fmt: skip

    def modified(self, q: Quantities) -> Values:
        return {"calcium": q.calcium * ops.exp(q.calcium_per_length * q.length_change)}
