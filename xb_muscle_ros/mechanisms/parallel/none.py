"""No parallel element."""

from __future__ import annotations

from xb_muscle_ros.mechanisms.base import Parallel, Quantities
from xb_muscle_ros.mechanisms.ops import Expr


class NoParallel(Parallel):
    """The family's null block: no force."""

    name = "none"

    def force(self, q: Quantities) -> Expr:
        """See the class."""
        return 0.0
