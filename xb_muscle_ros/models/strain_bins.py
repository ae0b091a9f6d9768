"""Whether the bins of a strain grid are narrow enough for the heads that attach to them."""

from __future__ import annotations

import math
from collections.abc import Mapping

# Sums over bins h apart miss a normal density of standard deviation w by 2 exp(-2 (pi w / h)^2): at 1.25 by 7e-6.
_WIDEST_BIN = 1.25


def wide_bins_line(values: Mapping[str, float]) -> str:
    """One line on bins that are too wide; empty where they are not, or where there are none.

    Args:
        values: of a fibre's parameters; widths in power strokes.
    """
    if "bins" not in values:
        return ""
    span, attaching = 2.0 * values["strain_range"], values["w"]
    enough = math.ceil(span / (_WIDEST_BIN * attaching)) + 1
    if values["bins"] >= enough:
        return ""
    width = span / (values["bins"] - 1.0)
    missed = min(2.0 * math.exp(-2.0 * (math.pi * attaching / width) ** 2), 1.0)
    return (
        f"strain bins of {width:.2g} power strokes are too wide for heads that attach with an sd of {attaching:.2g}: "
        f"attachment errs by up to {100.0 * missed:.3g} %, and jumps as bins move; take {enough} bins or more"
    )
