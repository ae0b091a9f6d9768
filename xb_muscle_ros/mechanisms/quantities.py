"""What a block may ask for by name: parameters, states, inputs, and what other blocks provide."""

from __future__ import annotations

from collections.abc import Mapping

from xb_muscle_ros.errors import suggest
from xb_muscle_ros.mechanisms import ops
from xb_muscle_ros.mechanisms.ops import Expr


class Quantities:
    """What a block may ask for, by name: its parameters, the states of all blocks, inputs, and provided quantities.

    Names that exist in every cross-bridge model: ``calcium`` (µM), ``velocity`` (L0/s), ``length_change`` (L0),
    ``sarcomere_change`` (L0, that of the half-sarcomeres: without the series element's), ``q0 q1 q2`` (moments),
    ``force_xb`` (cross-bridge force, power-stroke units), ``forcibly_detached`` (R), ``available_sites`` (N),
    ``ready_heads`` (D), ``gamma``, and ``recruitment`` (what brings super-relaxed heads into play beside force; 0
    unless a mechanism says otherwise).

    ``positive``, ``divisor``, ``variance`` and ``limit`` are the places where the released parameter sets were fitted
    with smooth functions; without smoothing they are exact.
    """

    # Fewer attached heads than this fraction carry no force worth a digit, and are less than the error of a fixed step;
    # it keeps Q1/Q0 defined at rest, and where a quick movement has taken all heads off and left rounding behind.
    EMPTY = 1e-7

    def __init__(self, values: Mapping[str, Expr], block: str, smoothing: Expr | None) -> None:
        self._values = dict(values)
        self._block = block
        self._smoothing = smoothing

    def __getattr__(self, name: str) -> Expr:
        """A quantity by name; fails with the block's and the quantity's name."""
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self._values[name]
        except KeyError:
            raise AttributeError(
                f"mechanism {self._block} asks for '{name}', which no block of this model provides"
                f"{suggest(name, self._values)}"
            ) from None

    def __contains__(self, name: str) -> bool:
        """Whether the model has a quantity of this name."""
        return name in self._values

    def for_block(self, block: str, **more: Expr) -> Quantities:
        """The same quantities and some more, in the hands of another block."""
        return Quantities({**self._values, **more}, block, self._smoothing)

    @property
    def smooth(self) -> bool:
        """Whether the smooth functions of the released sets stand in for the exact ones."""
        return self._smoothing is not None

    def positive(self, z: Expr) -> Expr:
        """Positive part, or its softplus."""
        return ops.positive(z) if self._smoothing is None else ops.softplus(z, self._smoothing)

    def divisor(self, q0: Expr) -> Expr:
        """Attached fraction as a divisor: never less than `EMPTY`, and within (EMPTY/Q0)²/2 of itself above."""
        if self._smoothing is None:
            return ops.sqrt(ops.positive(q0) ** 2 + self.EMPTY**2)
        return ops.softplus(q0, self._smoothing)

    def variance(self, z: Expr) -> Expr:
        """Variance of the strain distribution."""
        return z if self._smoothing is None else ops.softplus(z, self._smoothing)

    def limit(self, exponent: Expr) -> Expr:
        """Exponent of a detachment moment, limited to ±10 in the released sets.

        Exact ones level off above 12. A rate grows 160,000-fold until then, and heads are gone within a microsecond
        either way; without any limit a quick release pulls them into a singularity that no step size resolves: the
        fewer are left the more strain is theirs, and the faster they go.
        """
        return ops.limited(exponent) if self._smoothing is None else 10 * ops.tanh(exponent / 10)
