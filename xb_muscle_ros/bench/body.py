"""A tick of a whole leg model with eighty muscles: MuJoCo's own beside cross-bridges."""

from __future__ import annotations

import copy
import itertools
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from xb_muscle_ros.bench.measure import Figure, Setting
from xb_muscle_ros.plant.engine import mujoco, myo_sim, quiet
from xb_muscle_ros.plant.mjcf.muscles import CrossBridgeMuscles

RIGID, ELASTIC = "rigid tendons", "elastic tendons"
TABLES: dict[str, dict[str, Any]] = {RIGID: {}, ELASTIC: {"default": {"tendon": "elastic"}}}
_OWN, _EXACT = "MuJoCo's own muscles", "rigid tendons, exact functions (smoothing 0)"
_TIMED = {**TABLES, _EXACT: {"default": {"parameters": {"smoothing": 0.0}}}}
_TICK_S = 1e-3
_ACTIVATION = 0.2
# The body stands on its feet; before kinds of muscle lead to different contacts it starts anew.
_EPISODE_TICKS, _EPISODES = 50, 16
_RATIO, _REAL_TIME = {RIGID: "bar 1.7"}, {RIGID: "bar 6", ELASTIC: "bar 3"}


def leg() -> Any:
    """MyoLeg (80 muscles, 34 velocities) as it comes, with a time step of 1 ms.

    Raises:
        UserError: MuJoCo or myo-sim is not installed; both come with the extra ``body``.
    """
    mj, library = mujoco(), myo_sim()
    with quiet(mj):
        model = library.load_model("myolegs")
    model.opt.timestep = _TICK_S
    return model


class _Variant:
    """The model with one kind of muscle: what begins an episode, what is a tick, and what the tick consists of."""

    def __init__(self, model: Any, table: dict[str, Any] | None) -> None:
        self._mj = mujoco()
        self._model = copy.copy(model)
        self.muscles = None if table is None else CrossBridgeMuscles(self._model, table)
        self._data = self._mj.MjData(self._model)
        self._excitation = np.full(model.nu, _ACTIVATION)

    def restart(self) -> None:
        """Stand, with all muscles at one activation."""
        self._mj.mj_resetDataKeyframe(self._model, self._data, 0)
        if self.muscles is None:
            self._data.act[:] = self._data.ctrl[:] = _ACTIVATION
        else:
            self.muscles.reset(self._data, self.muscles.calcium_um(_ACTIVATION))

    def tick(self) -> None:
        """One millisecond."""
        if self.muscles is None:
            self._mj.mj_step(self._model, self._data)
        else:
            self.muscles.step(self._data, self._excitation)

    def parts(self, muscles: CrossBridgeMuscles) -> tuple[float, float]:
        """One millisecond in pieces: seconds of both halves of MuJoCo's step, and of the fibres' own."""
        model, data = self._model, self._data
        engine = _seconds(lambda: self._mj.mj_step1(model, data))
        length, calcium = muscles.length_change_l0(data), muscles.calcium_um(_ACTIVATION)
        begun = time.perf_counter()
        force = muscles.fibre_groups.advance(length, calcium, _TICK_S)
        fibres = time.perf_counter() - begun
        data.ctrl[muscles.index] = -muscles.f0_n * force
        return engine + _seconds(lambda: self._mj.mj_step2(model, data)), fibres


def study(setting: Setting) -> list[Figure]:
    """Time of a tick by kind of muscle, in turn within one run, and where it goes."""
    del setting  # always of the packaged fibre
    model = leg()
    variants = {name: _Variant(model, table) for name, table in [(_OWN, None), *_TIMED.items()]}
    took: dict[str, list[float]] = {name: [] for name in variants}
    parts: dict[str, list[tuple[float, float]]] = {name: [] for name in variants}
    for _, (name, variant) in itertools.product(range(_EPISODES), variants.items()):
        variant.restart()
        took[name] += [_seconds(variant.tick) for _ in range(_EPISODE_TICKS)]
        if variant.muscles is not None:
            variant.restart()
            parts[name] += [variant.parts(variant.muscles) for _ in range(_EPISODE_TICKS)]
    own = float(np.median(took[_OWN]))
    what = f"{model.nu} muscles, {model.nv} velocities, feet on the ground, activation {_ACTIVATION:g}"
    made = [_figure(f"MyoLeg, {_OWN}: 1 ms tick", took[_OWN], what)]
    for name in _TIMED:
        made += _of_fibres(name, took[name], own, parts[name])
    return made


def _of_fibres(kind: str, took: list[float], own: float, parts: list[tuple[float, float]]) -> list[Figure]:
    tick = float(np.median(took))
    engine, fibres = np.median(parts, axis=0).tolist()
    rest = tick - engine - fibres
    shares = f"engine {1e6 * engine:.1f} µs, fibres {1e6 * fibres:.1f} µs, the rest (Python) {1e6 * rest:.1f} µs"
    name = f"MyoLeg, 3state_coop, {kind}"
    return [
        _figure(f"{name}: 1 ms tick", took, shares),
        Figure(f"{name}: over {_OWN}", tick / own, "1", _RATIO.get(kind, "no bar")),
        Figure(f"{name}: times real time", _TICK_S / tick, "1", _REAL_TIME.get(kind, "no bar")),
    ]


def _figure(name: str, took: list[float], compared_with: str) -> Figure:
    low, middle, high = np.percentile(np.array(took) * 1e6, [25, 50, 75])
    return Figure(name, float(middle), "µs", compared_with, float(high - low) / 2.0)


def _seconds(work: Callable[[], object]) -> float:
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun
