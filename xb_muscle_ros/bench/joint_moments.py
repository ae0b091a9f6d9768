"""Isometric moments of the leg's joints: fibres beside MuJoCo's own muscles, over the joints' ranges."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.bench.body import ELASTIC, RIGID, TABLES, leg
from xb_muscle_ros.bench.measure import Figure, Setting
from xb_muscle_ros.plant.mjcf.moments import JointMoments, Moments
from xb_muscle_ros.plotting.style import DATA, MODEL, SECOND, figure, save

_POSTURES = 21
_ACTIVATIONS = {1.0: "full", 0.5: "half", 0.0: "no"}
_LINES: dict[str, dict[str, Any]] = {
    RIGID: {"color": MODEL, "linestyle": "-"},
    ELASTIC: {"color": SECOND, "linestyle": (0, (4, 1.5))},
}


class _Joint(NamedTuple):
    name: str
    title: str
    turning: tuple[str, str]
    """Muscles that turn it towards + and towards -."""


_JOINTS = (
    _Joint("ankle_angle_r", "Ankle, dorsiflexion", ("dorsiflexors", "plantarflexors")),
    _Joint("knee_angle_r", "Knee, flexion", ("knee flexors", "knee extensors")),
)


def study(setting: Setting) -> list[Figure]:
    """Largest differences of moments by joint, direction, activation and tendon; their figure beside the results."""
    model = leg()
    made: list[Figure] = []
    found: dict[tuple[str, str, float], Moments] = {}
    for kind, table in TABLES.items():
        moments = JointMoments(model, table)
        for joint in _JOINTS:
            for activation, word in _ACTIVATIONS.items():
                one = moments.along(joint.name, activation, model.key_qpos[0], _POSTURES)
                found[kind, joint.name, activation] = one
                for place, group in enumerate(joint.turning):
                    made += _differences(one, place, f"{group}, {word} activation, {kind}")
    _draw(setting.drawing("joint_moments"), found)
    return made


def _differences(moments: Moments, place: int, name: str) -> list[Figure]:
    peak = f"peak of MuJoCo's own {moments.own_nm[:, place].max():.4g} N·m"
    local = "% of MuJoCo's own at the posture, where over a tenth of its peak"
    return [
        Figure(f"{name}: largest difference", 100.0 * float(moments.of_peak[place]), "% of peak", peak),
        Figure(f"{name}: largest local difference", 100.0 * float(moments.of_local[place]), "%", local),
    ]


def _draw(path: Path, found: dict[tuple[str, str, float], Moments]) -> None:
    """A row for each joint, a panel for each direction; what is stronger is more activated."""
    with figure(178.0, 120.0) as made:
        panels = made.subplots(len(_JOINTS), 2)
        for row, joint in zip(panels, _JOINTS, strict=True):
            for place, (axes, group) in enumerate(zip(row, joint.turning, strict=True)):
                for activation in _ACTIVATIONS:
                    angle = np.degrees(found[RIGID, joint.name, activation].angle_rad)
                    own = found[RIGID, joint.name, activation].own_nm[:, place]
                    axes.plot(angle, own, color=DATA, linewidth=3.0, label="MuJoCo's own muscles")
                    for kind, line in _LINES.items():
                        axes.plot(
                            angle,
                            found[kind, joint.name, activation].fibres_nm[:, place],
                            label=f"fibres, {kind}",
                            **line,
                        )
                axes.set_title(group)
                axes.set_xlabel(f"{joint.title} (°)")
                axes.set_ylabel("Moment (N·m)")
                axes.set_ylim(bottom=0.0)
        handles, names = panels[0][0].get_legend_handles_labels()
        made.legend(handles[:3], names[:3], loc="outside upper center", ncols=3, frameon=False)
        save(made, path)
