"""Lengths that a fibre can be asked for, and what to say where a body goes beyond them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from xb_muscle_ros.node.rules import LENGTH_CHANGE_L0
from xb_muscle_ros.plant.loop import Trace
from xb_muscle_ros.plant.plant import Array


def beyond(muscles: Sequence[str], length_l0: Array) -> str:
    """Which muscle is longer or shorter than a fibre works; empty where none is.

    Args:
        muscles: names.
        length_l0: length changes of their fibres, shape (muscle,).
    """
    least, most = LENGTH_CHANGE_L0
    for name, change in zip(muscles, length_l0.tolist(), strict=True):
        if not least <= change <= most:
            return f"the fibre of {name} comes to {1.0 + change:.3f} L0, beyond {1.0 + least:g} to {1.0 + most:g} L0"
    return ""


def beyond_in(trace: Trace) -> str:
    """The same for the first such moment of a run, with its time."""
    least, most = LENGTH_CHANGE_L0
    outside = ~np.all((trace.length_change_l0 >= least) & (trace.length_change_l0 <= most), axis=1)
    if not outside.any():
        return ""
    k = int(np.argmax(outside))
    return (
        f"{trace.label}: {beyond(trace.muscles, trace.length_change_l0[k])}, from t = {trace.time_s[k]:.3f} s on; "
        "what comes after that is no muscle's answer, so take a shorter --duration or a smaller --displacement"
    )
