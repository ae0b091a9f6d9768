"""The real recordings that are diagnosed: which trials are shown, which are concealed, and where the model starts."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares, nnls

from xb_muscle_ros.models.fibre_file import Fibre, changed, load_fibre
from xb_muscle_ros.trials.trial import Phase, Trial

Array = npt.NDArray[np.float64]

RAT_SOLEUS = "18Dec2017a"


@dataclass(frozen=True)
class Case:
    """One study.

    Attributes:
        key: of the command line and of files.
        about: Markdown that begins its section: what is shown, what is concealed, what is assumed.
        imports: mapping file below scripts/datasets and files below the folder of recordings.
        shown: regular expressions of the trials that are diagnosed.
        concealed: the same of those that are only predicted, by what they test.
        start: the fibre that the shown trials start from.
        prefit: whether its parameters are fitted from several starts first.
        prepare: what is done to a trial before anything else.
    """

    key: str
    about: str
    imports: tuple[tuple[str, str], ...]
    shown: tuple[str, ...]
    concealed: Mapping[str, tuple[str, ...]]
    start: Callable[[Sequence[Trial]], Fibre]
    prefit: bool = True
    prepare: Callable[[Trial], Trial] = field(default=lambda trial: trial)


def chosen(trials: Sequence[Trial], patterns: Sequence[str]) -> list[Trial]:
    """Trials whose whole name matches one of some regular expressions, in the order of the expressions."""
    return [t for p in patterns for t in trials if re.fullmatch(p, t.facts.trial)]


def straight_length(trial: Trial) -> Trial:
    """Length along straight lines between the ends of its phases, each pause at its mean.

    A muscle of 30 F0/L0 makes 3 % F0 of a wobble of 0.1 % L0 in a length record; its recorded force shows none.
    """
    phases = trial.facts.phases
    if not phases:
        return trial
    pauses = [p for p in phases if p.name in ("isometric", "hold", "recovery")]
    times, lengths = [], []
    for p in pauses:
        inside = (trial.time_s >= p.start_s) & (trial.time_s <= p.end_s)
        level = float(np.mean(trial.length_m[inside]))
        times += [p.start_s, p.end_s]
        lengths += [level, level]
    return replace(trial, length_m=np.interp(trial.time_s, times, lengths))


def until(trial: Trial, end_s: float) -> Trial:
    """The part of a trial up to a time, s."""
    kept, force = trial.time_s <= end_s, trial.force_time_s <= end_s
    phases = tuple(
        Phase(p.name, p.start_s, min(p.end_s, end_s)) for p in trial.facts.phases if p.start_s < end_s
    )  # fmt: skip
    return replace(
        trial,
        facts=replace(trial.facts, phases=phases),
        time_s=trial.time_s[kept],
        length_m=trial.length_m[kept],
        force_time_s=trial.force_time_s[force],
        force_n=trial.force_n[force],
    )


def end_of_stimulation_s(trial: Trial) -> float:
    """When calcium first falls, s; infinity where it does not."""
    falls = np.flatnonzero(np.diff(trial.calcium_um) < 0.0)
    return float(trial.calcium_time_s[falls[0] + 1]) if falls.size else np.inf


def stimulated(trial: Trial) -> Trial:
    """A trial with straight lengths, without what follows stimulation: how fast calcium goes is assumed, not known."""
    return until(straight_length(trial), end_of_stimulation_s(trial))


def resting_spring(trials: Sequence[Trial], before_s: float, gamma: float) -> dict[str, float]:
    """Kpe and Fpe0 of a linear parallel spring from the forces of a muscle at rest, by least squares.

    Args:
        trials: with different lengths.
        before_s: at rest until then.
        gamma: power strokes in L0, as in the model.
    """
    stretch = np.array([max(float(np.mean(t.length_change_l0[t.time_s < before_s])), 0.0) for t in trials])
    force = np.array([float(np.mean(t.measured_f0[t.force_time_s < before_s])) for t in trials])
    slope, offset = nnls(np.column_stack([stretch, np.ones(stretch.size)]), force)[0]
    return {"kpe": max(float(slope) / gamma, 1e-6), "Fpe0": max(float(offset), 1e-6)}


def soft_spring(length_l0: Array, force_f0: Array, gamma: float) -> dict[str, float]:
    """kpe, lpe0 and pe_sharpness of F = kpe gamma ln(1 + exp(K (ΔL - lpe0)))/K by least squares."""

    def fit_from(start: Array) -> Any:
        def left(z: Array) -> Array:
            sharpness = np.exp(z[2])
            force = np.exp(z[0]) * np.logaddexp(0.0, sharpness * (length_l0 - z[1])) / sharpness
            # Next to nothing, so that what the forces do not tell stays where it was.
            return np.append(force - force_f0, 1e-3 * (z - start))

        return least_squares(left, start, bounds=([-7.0, -0.5, 0.7], [5.0, 0.5, 6.0]))

    starts = [np.array([0.0, at, sharpness]) for at in (0.0, 0.1) for sharpness in (2.3, 4.0)]
    best = min((fit_from(start) for start in starts), key=lambda found: found.cost)
    return {"kpe": float(np.exp(best.x[0])) / gamma, "lpe0": float(best.x[1]), "pe_sharpness": float(np.exp(best.x[2]))}


def _rat(trials: Sequence[Trial]) -> Fibre:
    return load_fibre(RAT_SOLEUS, "3state_coop")


def _as(trials: Sequence[Trial], model: str, changes: Mapping[str, float]) -> Fibre:
    """A model of the rat soleus fibre as another muscle's."""
    facts = trials[0].facts
    fibre = changed(load_fibre(RAT_SOLEUS, model), {"smoothing": 0.0, **changes}, facts.fibre)
    return replace(
        fibre,
        name=facts.fibre,
        reference_length_m=facts.reference_length_m,
        f0_n=facts.f0_n,
        source=f"start: rat soleus fibre {RAT_SOLEUS}",
        path=None,
    )


def _whole_muscle(trials: Sequence[Trial], rest_s: float) -> Fibre:
    return _as(trials, "3state_coop", resting_spring(trials, rest_s, 130.0))


def _cat(trials: Sequence[Trial]) -> Fibre:
    return _whole_muscle(trials, 0.95)


def _gastrocnemius(trials: Sequence[Trial]) -> Fibre:
    return _whole_muscle(trials, 0.01)


def _trabecula(trials: Sequence[Trial]) -> Fibre:
    """Cross-bridges off: what is left is the parallel spring, the one that comes nearest to all forces."""
    length = np.concatenate([t.length_change_l0 for t in trials])
    force = np.concatenate([t.measured_f0 for t in trials])
    return _as(trials, "2state_rigid_softplus", {"f": 1e-9, **soft_spring(length, force, 130.0)})


_ABOUT = {
    "rat": """## Rat soleus fibre 18Dec2017a

Shown: stretch-shorten-stretch at five pCa. Concealed: the two triangles of 6.4 % L0 at pCa 4.5, 6.6 and 9
(unsmoothed). The start is the released set.""",
    "cat": """## Cat soleus, whole muscle (Herzog and Leonard 2002)

Shown: the isometric reference at the short length (43) and active ramps of 3 mm/s to 9 mm from 0, 3 and 6 mm (50,
47, 45). Concealed: the isometric references at the long length, the ramps of 27 mm/s and the passive ramps. The
effect is known: residual force enhancement, more force after an active stretch than isometrically at the same
length. Assumed: calcium of 8 uM while stimulated, so trials end with stimulation; lengths are straight between the
corners, because the model would make 3 % F0 of the record's wobble. The passive force is known from rest before
stimulation at 0, 3 and 6 mm alone, and the base's parallel spring is linear.""",
    "trabecula_relaxed": """## Mouse trabecula, relaxed

Cross-bridges are off (no attachment): the base is a soft parallel spring. Shown: ramps of 22.5 % L0 in 0.1, 10 and
100 s; concealed: in 1 s. F0 is an assumption (50 kPa).""",
    "trabecula_blocked": """## Mouse trabecula, cross-bridges blocked with mavacamten

Shown: relaxed ramps of 0.1 and 10 s, blocked ones of 0.1 s at pCa 6.2, 5.8 and 4.4 and of 10 s at 4.4. Concealed:
ramps of 1 and 100 s, relaxed and at pCa 4.4. Calcium changes passive force here with cross-bridges off.""",
    "gastrocnemius": """## Rat gastrocnemius in situ

Shown: two isometric contractions, a quick release, two releases with a ramp, one stretch-shortening cycle of 5 Hz.
Concealed: another contraction, release, two ramps and four kinds of cycles. The start is a rat soleus fibre, a
slower muscle; calcium comes from stimulation.""",
}
_TRIANGLES = (r"triangle\d_pca\d+",)
_MOUSE = (("mouse_trabecula_titin", "mouse_trabecula_titin/*.csv"),)
_CASES = (
    Case(
        "rat",
        _ABOUT["rat"],
        (
            ("rat_soleus_18Dec2017a", "rat_soleus_18Dec2017a/amp*.csv"),
            ("rat_soleus_18Dec2017a_triangles", "rat_soleus_18Dec2017a/triangle*.csv"),
        ),
        (r"amp383_rt1ms_pca\d+",),
        {"triangles": _TRIANGLES},
        _rat,
        prefit=False,
    ),
    Case(
        "cat",
        _ABOUT["cat"],
        (("cat_soleus_herzog_leonard_2002", "cat_soleus_herzog_leonard_2002/*.csv"),),
        (r"fig6and7A_trial43", r"fig6and7A_trial45", r"fig6and7A_trial47", r"fig6and7A_trial50"),
        {
            "isometric, long": (r"fig6and7A_trial44", r"fig7C_trial60"),
            "ramps of 27 mm/s": (r"fig7C_trial61", r"fig7C_trial63", r"fig7C_trial65"),
            "passive ramps": (r"fig6and7A_trial49", r"fig7C_trial66"),
            "isometric, short, again": (r"fig7C_trial59",),
        },
        _cat,
        prepare=stimulated,
    ),
    Case(
        "trabecula_relaxed",
        _ABOUT["trabecula_relaxed"],
        _MOUSE,
        (r"AvgRelaxed_0\.1s", r"AvgRelaxed_10s", r"AvgRelaxed_100s"),
        {"unseen speed": (r"AvgRelaxed_1s",)},
        _trabecula,
        prefit=False,
    ),
    Case(
        "trabecula_blocked",
        _ABOUT["trabecula_blocked"],
        _MOUSE,
        (
            r"AvgRelaxed_0\.1s", r"AvgRelaxed_10s", r"AvgMava_pCa6\.2_0\.1s", r"AvgMava_pCa5\.8_0\.1s",
            r"AvgMava_pCa4\.4_0\.1s", r"AvgMava_pCa4\.4_10s",
        ),
        {
            "unseen speeds, relaxed": (r"AvgRelaxed_1s", r"AvgRelaxed_100s"),
            "unseen speeds, pCa 4.4": (r"AvgMava_pCa4\.4_1s", r"AvgMava_pCa4\.4_100s"),
        },
        _trabecula,
        prefit=False,
    ),
    Case(
        "gastrocnemius",
        _ABOUT["gastrocnemius"],
        (("rat_gastrocnemius_in_situ", "rat_gastrocnemius_in_situ/*.csv"),),
        (r"GMe1_ISOM01", r"GMe1_ISOM12", r"GMe1_QR03", r"GMe1_SR01", r"GMe1_SR06", r"GMe1_SSC_PA05_1"),
        {
            "isometric": (r"GMe1_ISOM06",),
            "release": (r"GMe1_QR07",),
            "release and ramp": (r"GMe1_SR03", r"GMe1_SR09"),
            "cycles": (r"GMe1_SSC_PA01_1", r"GMe1_SSC_PA03_1", r"GMe1_SSC_PA05_2", r"GMe1_SSC_PA08_1"),
        },
        _gastrocnemius,
    ),
)  # fmt: skip
CASES: Mapping[str, Case] = MappingProxyType({case.key: case for case in _CASES})
"""All cases by key."""
