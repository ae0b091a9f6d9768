"""What a fit, a diagnosis and its report know of a mechanism: written beside the block's equations."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

Starts = tuple[Mapping[str, float], ...]


@dataclass(frozen=True)
class Entry:
    """One mechanism that a model's name may add with ``+``.

    Attributes:
        family: mechanisms that act on the same thing in nearly the same way; words joined by underscores.
        title: how a sentence calls the mechanism.
        meaning: what it is, in a line that follows a colon.
        effect: parameter that is 0 where the mechanism is absent; None where its absence is another block.
        size: of the effect to expect, in its unit; standard deviation of its prior.
        shape: further parameters that are fitted, each with the factor (as a logarithm) by which it is expected to
            vary, or for a parameter that may be negative its standard deviation.
        starts: values that the parameters may start from; every one is tried.
        start_from: such values from those of the base model, where they depend on them.
        reach: largest effect that is still this mechanism, in units of `size`.
        off: values beside that of the effect at which a diagnosis has the mechanism do exactly nothing.
        frame: whether no values do so, and a diagnosis needs a model of its own for it.
        name: of the mechanism; empty: that of the block.
    """

    family: str
    title: str
    meaning: str
    effect: str | None
    size: float = 1.0
    shape: Mapping[str, float] = field(default_factory=dict)
    starts: Starts = ({},)
    start_from: Callable[[Mapping[str, float]], Starts] | None = None
    reach: float = 30.0
    off: Mapping[str, float] = field(default_factory=dict)
    frame: bool = False
    name: str = ""

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of all parameters that are fitted for it."""
        return (*((self.effect,) if self.effect else ()), *self.shape)

    @property
    def absent(self) -> dict[str, float]:
        """Values of parameters at which the mechanism does exactly nothing; empty where it is another model."""
        return {**({self.effect: 0.0} if self.effect else {}), **self.off}

    def starting_values(self, base: Mapping[str, float]) -> Starts:
        """Values to start from in a model with the base's values."""
        return self.starts if self.start_from is None else self.start_from(base)
