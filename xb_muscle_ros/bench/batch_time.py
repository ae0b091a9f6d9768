"""Many fibres, one tick: the cost of a control loop's step, and the memory of large batches on a grid."""

from __future__ import annotations

import functools
import itertools
import resource
import subprocess
import sys
from dataclasses import replace

import numpy as np

from xb_muscle_ros.bench.measure import Figure, Setting, timed
from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.fibre_file import Fibre, load_fibre

FIBRES = ("13Dec2017a", "13Dec2017b", "14Dec2017b", "18Dec2017a", "18Dec2017b", "19Dec2017a", "7Aug2018a")
_TICK_S = 1e-3
_LARGE = 1000
_LARGE_BINS = 500


def many(count: int, smoothing: float = 100.0, method: str = "gaussian", bins: float = 0.0) -> list[Fibre]:
    """Fibres in turn of the seven released sets."""
    made = []
    for name in itertools.islice(itertools.cycle(FIBRES), count):
        fibre = load_fibre(name, method=method)
        changed = {"smoothing": smoothing} | ({"bins": bins} if bins else {})
        made.append(replace(fibre, values={**fibre.values, **changed}))
    return made


def study(setting: Setting) -> list[Figure]:
    """Time of a 1 ms tick of 100 moving fibres, its force error, and the memory of 1,000 fibres on a grid."""
    del setting  # always of the released fibres
    made = []
    for smoothing, kind in ((100.0, "smooth"), (0.0, "exact")):
        batch = MuscleBatch(many(100, smoothing))
        calcium = 10.0 ** (6.0 - np.linspace(4.5, 6.6, 100))
        states = batch.settle(np.zeros(100), calcium)
        # A step in the middle of a stretch at the paper's speed.
        for k in range(20):
            states = batch.step(states, np.full(100, 4.545e-4 * (k + 1)), calcium, _TICK_S)
        length = np.full(100, 4.545e-4 * 21)
        work = functools.partial(batch.step, states, length, calcium, _TICK_S)
        once = batch.outputs(work())["force_f0"]
        fine = states
        for k in range(32):
            part = states[:, -3] + (length - states[:, -3]) * ((k + 1) / 32)
            fine = batch.step(fine, part, calcium, _TICK_S / 32)
        error = 100.0 * float(np.abs(once - batch.outputs(fine)["force_f0"]).max())
        what = f"largest force error {error:.2g} % F0"
        made.append(timed(f"100 fibres, one 1 ms tick, {kind}", work, 2001, "µs", what))
    command = [sys.executable, "-c", "from xb_muscle_ros.bench.batch_time import large; print(large())"]
    # Once to compile, which takes memory of its own, once to measure.
    subprocess.run(command, check=True, capture_output=True)
    peak = float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    what = "whole process; 300 MB were asked for"
    made.append(Figure(f"memory of {_LARGE} fibres, {_LARGE_BINS} bins each", peak, "MB", what))
    return made


def large() -> float:
    """Step a large batch on a grid; returns the process's peak memory in MB."""
    batch = MuscleBatch(many(_LARGE, 0.0, "characteristics", float(_LARGE_BINS)))
    states = np.stack([muscle.rest() for muscle in batch.muscles])
    for _ in range(5):
        states = batch.step(states, np.zeros(_LARGE), np.ones(_LARGE), _TICK_S)
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
