"""What the scene of the leg says: numbers, tables, and files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.files import write_json
from xb_muscle_ros.plant.leg.body import Body
from xb_muscle_ros.plant.leg.episode import JOINTS, Episode
from xb_muscle_ros.plant.leg.measures import STIFFNESS_AT_S, growth, held, numbers
from xb_muscle_ros.plant.leg.stance import Stance
from xb_muscle_ros.plant.leg.statics import demand
from xb_muscle_ros.plant.leg.study import ModelRuns, Pair
from xb_muscle_ros.plant.translation import RampAndHold
from xb_muscle_ros.tables import Filled, aligned, number, write_csv

_TRACED = ("soleus_r", "gasmed_r", "gaslat_r", "fhl_r", "tibant_r", "vaslat_r")
_DIGITS = 8
_SCORES = (
    ("stiffness_20ms_mgh", "stiffness 20 ms [mgh]", ".2f", 1.0),
    ("stiffness_50ms_mgh", "50 ms [mgh]", ".2f", 1.0),
    ("stiffness_100ms_mgh", "100 ms [mgh]", ".2f", 1.0),
    ("com_100ms_m", "centre of mass 100 ms [mm]", ".1f", 1e3),
    ("com_300ms_m", "300 ms [mm]", ".1f", 1e3),
    ("time_to_fall_s", "falls at [s]", ".3f", 1.0),
)


def push_label(platform: RampAndHold | None) -> str:
    """Direction and way."""
    if platform is None:
        return "no push"
    way = "backwards" if platform.displacement_m < 0.0 else "forwards"
    return f"{way} {100.0 * abs(platform.displacement_m):.3g} cm"


def hold_rows(runs: Sequence[ModelRuns]) -> Filled:
    """Standing without a push: how far, and what grows from a nudge."""
    made = []
    for one in runs:
        found, grown = held(one.hold), growth(one.nudged)
        made.append(
            [
                one.model,
                number(found["largest_com_m"], ".2g", 1e3),
                number(found["start_acceleration"], ".1g"),
                number(grown["e_fold_s"], ".0f", 1e3),
                *(number(grown.get(f"{joint}_by_ankle"), ".2f") for joint in JOINTS[1:]),
            ]
        )
    last = f"centre of mass in {runs[0].hold.time_s[-1]:g} s [mm]"
    heads = ["model", last, "start [rad/s²]", "e-fold [ms]", "knee / ankle", "hip / ankle"]
    return heads, made


def push_pairs(one: ModelRuns) -> list[Pair]:
    """Pushes without sway, each with the episode that was not pushed."""
    return [Pair(one.pairs[0].still, pushed) for pushed in one.pushes]


def push_rows(runs: Sequence[ModelRuns]) -> Filled:
    """Main numbers of pushes without sway."""
    made = []
    for one in runs:
        for pair in push_pairs(one):
            found = numbers(pair)
            cells = [number(found[key], form, factor) for key, _, form, factor in _SCORES]
            made.append([one.model, push_label(pair.pushed.platform), *cells])
    return ["model", "platform", *(head for _, head, _, _ in _SCORES)], made


def sway_rows(runs: Sequence[ModelRuns]) -> Filled:
    """What sway before the push takes away, beside no sway."""
    made = []
    for one in runs:
        rest = numbers(one.pairs[0])
        for pair in one.pairs:
            found = numbers(pair)
            torque, first = found["torque_at_start_nm"], rest["torque_at_start_nm"]
            lost = None if torque is None or first is None else torque - first
            cells = [number(lost, "+.2f")]
            for time_s in STIFFNESS_AT_S:
                key = f"stiffness_{1000 * time_s:.0f}ms_nm_per_rad"
                cells.append(number(share(found[key], rest[key]), "+.1f", 100.0))
            for key in ("com_300ms_by_push_m", "com_300ms_without_push_m"):
                cells.append(number(found[key], ".1f", 1e3))
            cells += [number(found[key], ".3f") for key in ("time_to_fall_s", "time_to_fall_without_push_s")]
            made.append([one.model, pair.pushed.sway.label, *cells])
    heads = ["model", "before", "torque at release [N·m]"]
    heads += [f"stiffness {1000 * STIFFNESS_AT_S[0]:.0f} ms [%]"]
    heads += [f"{1000 * time_s:.0f} ms [%]" for time_s in STIFFNESS_AT_S[1:]]
    heads += ["way by push 300 ms [mm]", "without push [mm]", "falls at [s]", "without push [s]"]
    return heads, made


def share(value: float | None, of: float | None) -> float | None:
    """Change of a value from another, as a share of it."""
    return None if value is None or of is None or of == 0.0 else value / of - 1.0


def tables(runs: Sequence[ModelRuns]) -> str:
    """All three as aligned text."""
    swayed = [sway_rows(runs)] if len(runs[0].pairs) > 1 else []
    return "\n\n".join(
        aligned(*filled, left=left)
        for filled, left in ((hold_rows(runs), (0,)), (push_rows(runs), (0, 1)), *((rows, (0, 1)) for rows in swayed))
    )


def ended(runs: Sequence[ModelRuns]) -> list[str]:
    """A line for each episode that its muscles could not go on with."""
    return [
        f"{episode.model}, {push_label(episode.platform)}, {episode.sway.label}: over at {episode.end.time_s:.3f} s, "
        f"before the body fell: {episode.end.reason}"
        for one in runs
        for episode in one.episodes
        if episode.end is not None and not episode.end.fell
    ]


def beyond_lengths(one: ModelRuns) -> list[str]:
    """A line for each episode of a model in which a fibre is longer or shorter than fibres work."""
    return [
        f"{push_label(episode.platform)}, {episode.sway.label}: {episode.beyond}"
        for episode in one.episodes
        if episode.beyond
    ]


def stance_tree(body: Body, stance: Stance) -> dict[str, Any]:
    """The stance as plain data; the body is put there."""
    # Contact forces of a body at rest, whatever its muscles do now.
    demand(body, stance.qpos)
    names = [body.model.joint(i).name for i in range(1, body.model.njnt)]
    at = body.model.jnt_qposadr[1:]
    reactions = body.contact_forces_n()
    return {
        **vars(stance.aim),
        "com_before_ankles_m": stance.lead_m,
        "mass_kg": body.mass_kg,
        "load_nm_per_rad": body.load_nm_per_rad,
        "residual_nm": stance.residual,
        "sum_of_squared_activations": float(np.sum(stance.activation**2)),
        "normal_forces_n": reactions[:, 0].tolist(),
        "joint_angles_rad": dict(zip(names, stance.qpos[at].tolist(), strict=True)),
        "root": stance.qpos[:7].tolist(),
        "force_n": dict(zip(body.muscles, stance.force_n.tolist(), strict=True)),
    }


def write(
    out: Path, body: Body, stance: Stance, runs: Sequence[ModelRuns], settings: dict[str, object], every: int = 1
) -> list[Path]:
    """Write ``loop.json`` (settings, stance, numbers) and ``loop.csv`` (traces); the same runs give the same bytes.

    Args:
        out: folder.
        body, stance, runs: what was run.
        settings: of the command.
        every: ticks from one row of ``loop.csv`` to the next; an episode's last tick always has one.
    """
    tree = {
        "scene": "myolegs",
        **settings,
        "csv_step_s": every * body.tick_s,
        "stance": stance_tree(body, stance),
        "runs": [
            {
                "model": one.model,
                **one.hold.driven_by,
                "beyond_lengths": beyond_lengths(one) or None,
                "hold": held(one.hold),
                "growth": growth(one.nudged),
                "pushes": [_told(pair) for pair in push_pairs(one)],
                "after_sway": [_told(pair) for pair in one.pairs],
            }
            for one in runs
        ],
    }
    write_json(out / "loop.json", tree)
    write_csv(out / "loop.csv", _samples(runs, every))
    return [out / "loop.json", out / "loop.csv"]


def _told(pair: Pair) -> dict[str, Any]:
    """Condition, numbers, and why it ended."""
    pushed, still = pair.pushed, pair.still
    return {
        "platform": None if pushed.platform is None else vars(pushed.platform),
        "sway": vars(pushed.sway),
        "numbers": numbers(pair),
        "end": None if pushed.end is None else vars(pushed.end),
        "end_without_push": None if still.end is None else vars(still.end),
    }


def _samples(runs: Sequence[ModelRuns], every: int) -> Iterator[dict[str, Any]]:
    """Long format: a row for each episode and some of its ticks."""
    muscles = runs[0].hold.muscles
    traced = [muscles.index(name) for name in _TRACED]
    names = ["time_s", "com_m", "height_m"]
    names += [f"{joint}_{what}" for what in ("rad", "nm") for joint in JOINTS]
    names += ["soleus_r.length_m", *(f"{name}.force_n" for name in _TRACED)]
    for one in runs:
        for episode in one.episodes:
            label = {"model": one.model, "platform": push_label(episode.platform), "before": episode.sway.label}
            last = episode.time_s.size - 1
            kept = np.unique([*range(0, last, every), last])
            for values in _columns(episode, traced)[kept].tolist():
                yield {**label, **dict(zip(names, map(_short, values), strict=True))}


def _short(value: float) -> float:
    """A number to `_DIGITS`: more says nothing of a model, and doubles the file."""
    return float(f"{value:.{_DIGITS}g}")


def _columns(episode: Episode, traced: Sequence[int]) -> Any:
    return np.column_stack(
        (
            episode.time_s,
            episode.com_m,
            episode.height_m,
            episode.angle_rad,
            episode.torque_nm,
            episode.soleus_m,
            episode.force_n[:, list(traced)],
        )
    )
