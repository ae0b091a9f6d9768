"""The real recordings that are diagnosed: training trials, held-out trials, and where the model starts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from recorded_trials import at_rest, soft_spring, stimulated

from xb_muscle_ros.models.catalogue import CATALOGUE
from xb_muscle_ros.models.fibre_file import Fibre, changed, load_fibre
from xb_muscle_ros.trials.trial import Trial

RAT_SOLEUS = "18Dec2017a"
FIBRES = ("13Dec2017a", "14Dec2017b", "18Dec2017a", "18Dec2017b", "19Dec2017a")
"""Rat soleus fibres of whose recordings at the paper's two fitted protocols there is a copy."""
# Power strokes in L0: parameter gamma of the models.
_GAMMA = 130.0


class Source(NamedTuple):
    """Recordings to import.

    Attributes:
        mapping: file below scripts/datasets.
        pattern: files below the folder of recordings.
        fibre: whose they are; empty where the mapping says it.
    """

    mapping: str
    pattern: str
    fibre: str = ""


@dataclass(frozen=True)
class Case:
    """One study.

    Attributes:
        key: of the command line and of files.
        title: of its section.
        about: Markdown that begins its section: training trials, test trials, assumptions.
        imports: recordings.
        training: regular expressions of the trials that are diagnosed; all fibres among them are fibres of the study.
        held_out: the same of those that are only predicted, by what they test.
        start: the fibre that the training trials of one fibre start from.
        prefit: whether its parameters are fitted from several starts first.
        prepare: what is done to a trial before anything else.
        pooled: key of the study of many fibres of which this is one by itself; empty for others.
        features: whether a table has SRS and isometric force of its fibres, which are predicted as well.
        error_sds: of ordinary measurement errors, where the recordings' own description knows better.
        alike: held-out trials were recorded as the training ones were, so that they share errors of the whole set.
    """

    key: str
    title: str
    about: str
    imports: tuple[Source, ...]
    training: tuple[str, ...]
    held_out: Mapping[str, tuple[str, ...]]
    start: Callable[[Sequence[Trial]], Fibre]
    prefit: bool = True
    prepare: Callable[[Trial], Trial] = field(default=lambda trial: trial)
    pooled: str = ""
    features: bool = False
    error_sds: Mapping[str, float] = field(default_factory=dict)
    alike: bool = True


def released(model: str) -> Callable[[Sequence[Trial]], Fibre]:
    """The set of the package's own fibre file for the fibre of some trials."""
    return lambda trials: load_fibre(trials[0].facts.fibre, model)


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


def _whole_muscle(before_s: float) -> Callable[[Sequence[Trial]], Fibre]:
    """With a passive spring that is exponential below its resting length, and a force-length relation."""

    def start(trials: Sequence[Trial]) -> Fibre:
        overlap = CATALOGUE["filament_overlap"].starting_values({})[0]
        changes = {**soft_spring(*at_rest(trials, before_s), _GAMMA), **overlap}
        return _as(trials, "3state_coop_softplus+filament_overlap", changes)

    return start


def _trabecula(trials: Sequence[Trial]) -> Fibre:
    """Cross-bridges off: what is left is the parallel spring, the one that comes nearest to all forces."""
    length = np.concatenate([np.interp(t.force_time_s, t.time_s, t.length_change_l0) for t in trials])
    force = np.concatenate([t.measured_f0 for t in trials])
    return _as(trials, "2state_rigid_softplus", {"f": 1e-9, **soft_spring(length, force, _GAMMA)})


_TRIANGLES = (r"triangle\d_pca\d+",)
_KILOHERTZ = (
    Source("rat_soleus_18Dec2017a", "rat_soleus_18Dec2017a/amp*.csv"),
    Source("rat_soleus_18Dec2017a_triangles", "rat_soleus_18Dec2017a/triangle*.csv"),
)
_SIX_MS = (r"amp0_rt1ms_pca\d+", r"amp383_rt100ms_pca\d+")
_UNSEEN = {"1 kHz, RT 1 ms": (r"amp383_rt1ms_pca\d+",), "1 kHz, triangles": _TRIANGLES}
# Length was not recorded in these, but put in place to 2 ms.
_PLACED = MappingProxyType({"time_shift": 0.002})
_BASES = {
    "2state": "The base has no cooperativity: the paper's own conclusion is left out of it.",
    "3state_coop": "The base is the paper's model: what is missing beyond it is not known.",
}


def _of_fibres(*names: str) -> tuple[Source, ...]:
    """The 6 ms recordings of some fibres."""
    return tuple(Source("rat_soleus_fibres", f"rat_soleus_fibres/{name}/*.csv", name) for name in names)


def _pooled(model: str) -> Case:
    about = f"""Training trials: five fibres at the paper's two fitted protocols and 3 to 5 pCa, every 6 ms, diagnosed
as one study. Test trials: the 1 kHz recordings of fibre {RAT_SOLEUS} (RT 1 ms at five pCa, triangles). {_BASES[model]}
The start is the released set of each fibre. Lengths were put in place to 2 ms, so the time shift has an SD of 2 ms.
Whole solutions are left out in turn, so that the study's held-out errors are those of a pCa that the fit did not
see."""
    title = f"Five rat soleus fibres, base `{model}`"
    imports = (*_of_fibres(*FIBRES), *_KILOHERTZ)
    return Case(
        f"fibres_{model}", title, about, imports, _SIX_MS, _UNSEEN, released(model), False, features=True,
        error_sds=_PLACED, alike=False,
    )  # fmt: skip


def _single(name: str, model: str) -> Case:
    own = name == RAT_SOLEUS
    about = f"""Training trials: the fibre's recordings at the paper's two fitted protocols, every 6 ms.{
        " Test trials: its 1 kHz recordings (RT 1 ms at five pCa, triangles)." if own else ""
    } {_BASES[model]}"""
    return Case(
        f"fibre_{name}_{model}",
        f"Rat soleus fibre {name} by itself, base `{model}`",
        about,
        (*_of_fibres(name), *(_KILOHERTZ if own else ())),
        _SIX_MS,
        _UNSEEN if own else {},
        released(model),
        False,
        pooled=f"fibres_{model}",
        features=True,
        error_sds=_PLACED,
        alike=False,
    )


_RAT = """Training trials: stretch-shorten-stretch at five pCa, 1 kHz. Test trials: the two triangles of 6.4 % L0 at pCa
4.5, 6.6 and 9 (unsmoothed). The start is the released set."""
_CAT = """Training trials: the isometric reference at the short length (43) and active ramps of 3 mm/s to 9 mm from 0, 3
and 6 mm (50, 47, 45). Test trials: the isometric references at the long length, the ramps of 27 mm/s and the passive
ramps. The effect is known: residual force enhancement, more force after an active stretch than isometrically at the
same length. Assumed: calcium of 8 uM while stimulated; how fast it comes and goes is not known, so force counts from a
second after stimulation began until its end. Lengths are straight between the corners, because the model would make 3 %
F0 of the record's wobble; that wobble leaves each corner to about 10 ms, which is the SD of the time shift. The base is
`3state_coop` with a passive spring that is exponential below its resting length (`_softplus`; resting length and
sharpness from rest before stimulation at 0, 3 and 6 mm, which is all that training trials have of passive force) and a
force-length relation (`filament_overlap`, fitted with the rest). By hand, told what is missing: active titin leaves 1.0
% F0 of the training trials and slow passive viscoelasticity the same (log evidence 46 and 44 beside the base), so
neither is named; a passive stretch would part them, and is among the test trials. The fit with titin predicts isometric
force at the long length to 6.7 and 10 % F0 (base 14 and 18) and passive ramps to 1.7 and 4.1 (12 and 16), but ramps of
27 mm/s to 11 to 16 (6.5 to 7.7): slow ramps leave the strain sensitivity of detachment free to triple."""
_RELAXED = """Cross-bridges are off (no attachment): the base is a soft parallel spring. Training trials: ramps of 22.5
% L0 in 0.1, 10 and 100 s; test trial: in 1 s. F0 is an assumption (50 kPa)."""
_BLOCKED = """Training trials: relaxed ramps of 0.1 and 10 s, blocked ones of 0.1 s at pCa 6.2, 5.8 and 4.4 and of 10 s
at 4.4. Test trials: ramps of 1 and 100 s, relaxed and at pCa 4.4. Calcium changes passive force here with cross-bridges
off."""
_GASTROCNEMIUS = """Training trials: two isometric contractions, a quick release, two releases with a ramp, one
stretch-shortening cycle of 5 Hz. Test trials: another contraction, release, two ramps and four kinds of cycles. The
start is a rat soleus fibre, a slower muscle; calcium comes from stimulation. As for the cat, the base has a passive
spring that is exponential below its resting length, from rest before stimulation, and a force-length relation."""
_MOUSE = (Source("mouse_trabecula_titin", "mouse_trabecula_titin/*.csv"),)
_CASES = (
    *(_pooled(model) for model in _BASES),
    *(_single(name, model) for model in _BASES for name in FIBRES),
    Case(
        "rat", f"Rat soleus fibre {RAT_SOLEUS}", _RAT, _KILOHERTZ, (r"amp383_rt1ms_pca\d+",),
        {"triangles": _TRIANGLES}, released("3state_coop"), False,
    ),
    Case(
        "cat",
        "Cat soleus, whole muscle (Herzog and Leonard 2002)",
        _CAT,
        (Source("cat_soleus_herzog_leonard_2002", "cat_soleus_herzog_leonard_2002/*.csv"),),
        (r"fig6and7A_trial43", r"fig6and7A_trial45", r"fig6and7A_trial47", r"fig6and7A_trial50"),
        {
            "isometric, long": (r"fig6and7A_trial44", r"fig7C_trial60"),
            "ramps of 27 mm/s": (r"fig7C_trial61", r"fig7C_trial63", r"fig7C_trial65"),
            "passive ramps": (r"fig6and7A_trial49", r"fig7C_trial66"),
            "isometric, short, again": (r"fig7C_trial59",),
        },
        _whole_muscle(0.95),
        prepare=stimulated,
        error_sds={"time_shift": 0.01},
    ),
    Case(
        "trabecula_relaxed", "Mouse trabecula, relaxed", _RELAXED, _MOUSE,
        (r"AvgRelaxed_0\.1s", r"AvgRelaxed_10s", r"AvgRelaxed_100s"), {"unseen speed": (r"AvgRelaxed_1s",)},
        _trabecula, False,
    ),
    Case(
        "trabecula_blocked",
        "Mouse trabecula, cross-bridges blocked with mavacamten",
        _BLOCKED,
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
        False,
    ),
    Case(
        "gastrocnemius",
        "Rat gastrocnemius in situ",
        _GASTROCNEMIUS,
        (Source("rat_gastrocnemius_in_situ", "rat_gastrocnemius_in_situ/*.csv"),),
        (r"GMe1_ISOM01", r"GMe1_ISOM12", r"GMe1_QR03", r"GMe1_SR01", r"GMe1_SR06", r"GMe1_SSC_PA05_1"),
        {
            "isometric": (r"GMe1_ISOM06",),
            "release": (r"GMe1_QR07",),
            "release and ramp": (r"GMe1_SR03", r"GMe1_SR09"),
            "cycles": (r"GMe1_SSC_PA01_1", r"GMe1_SSC_PA03_1", r"GMe1_SSC_PA05_2", r"GMe1_SSC_PA08_1"),
        },
        _whole_muscle(0.01),
    ),
)  # fmt: skip
CASES: Mapping[str, Case] = MappingProxyType({case.key: case for case in _CASES})
"""All cases by key."""
