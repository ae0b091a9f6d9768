"""Records as a diagnosis might make them, with traces that belong to them: the numbers of one follow from the other."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import lfilter

from xb_muscle_ros.diagnose.report.traces import TrialTraces
from xb_muscle_ros.diagnose.result import (
    FORMAT,
    Component,
    Diagnosis,
    Feature,
    HeldOutGain,
    Kind,
    Law,
    NextExperiment,
    Nuisance,
    OfFibre,
    OfStudyFibre,
    OfTrial,
    Parameter,
    Place,
    Remaining,
    Scores,
    SetOfMechanisms,
    Verdict,
)

Array = Any
PCAS = (6.6, 6.4, 6.2, 6.1, 6.0, 5.8, 4.5)
PHASES = (
    ("isometric", 0.0, 0.2), ("conditioning_stretch", 0.2, 0.28), ("conditioning_shortening", 0.28, 0.36),
    ("recovery", 0.36, 0.66), ("test_stretch", 0.66, 0.74), ("hold", 0.74, 1.1),
)  # fmt: skip
STEP_S = 0.002
NOISE_F0 = 0.0012


class Sample(NamedTuple):
    """A record and its traces."""

    diagnosis: Diagnosis
    traces: tuple[TrialTraces, ...]


class Effect(NamedTuple):
    """A component to put into made recordings.

    Attributes:
        name, kind, family, members: of the component.
        probability: stated for it.
        size: of its signal, about F0.
        parameter: that the record tells.
        direction: in words.
    """

    name: str
    kind: Kind
    family: str
    members: tuple[str, ...]
    probability: float
    size: float
    parameter: Parameter
    direction: str


DETACHMENT = Effect(
    "forcible_detachment", Kind.MECHANISM, "heads_under_strain", ("forcible_detachment",), 0.998, 0.05,
    Parameter("k", "1/s", 1040.0, (870.0, 1230.0), spread=120.0), "lowers force late in fast stretch",
)  # fmt: skip
DRAG = Effect(
    "viscous_drag", Kind.MECHANISM, "parallel_viscoelasticity", ("viscous_drag",), 0.93, 0.02,
    Parameter("drag", "F0·s/L0", 0.0284, (0.019, 0.0371), spread=0.009),
    "raises force in stretch, lowers it in shortening",
)  # fmt: skip
SPRINGS = Effect(
    "calcium_dependent_elasticity", Kind.MECHANISM, "calcium_dependent_elasticity",
    ("active_titin", "static_calcium_stiffness"), 0.71, 0.012,
    Parameter("titin_stiffness", "F0/L0", 1.31, (0.42, 2.2)), "raises force while the fibre is longer",
)  # fmt: skip
DRIFT = Effect(
    "force_drift", Kind.ARTEFACT, "force_zero", ("force_drift",), 0.87, 0.015,
    Parameter("force_drift [pCa 6.2]", "F0/s", 0.0143, (0.0094, 0.0192)), "force creeps up during a trial",
)  # fmt: skip
LESS_LIKELY = (
    ("weakly_bound_heads", Kind.MECHANISM, "weak_binding", 0.34), ("nonlinear_crossbridge", Kind.MECHANISM,
    "heads_under_strain", 0.22), ("half_sarcomere_spread", Kind.MECHANISM, "heterogeneity", 0.11), ("pca_shift",
    Kind.ARTEFACT, "calcium_of_solutions", 0.06), ("lattice_spacing", Kind.MECHANISM, "length_dependence", 0.031),
    ("phosphate", Kind.MECHANISM, "rates", 0.008), ("transducer_lag", Kind.ARTEFACT, "timing", 0.004),
)  # fmt: skip


def remembered(speed: Array, tau_s: float) -> Array:
    """Speed through an exponential memory, L0."""
    return lfilter([STEP_S], [1.0, -math.exp(-STEP_S / tau_s)], speed)


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if np.size(values) else math.nan


def protocol() -> tuple[Array, Array]:
    """Time in s and length change in L0."""
    time_s = np.arange(0.0, PHASES[-1][2], STEP_S)
    return time_s, np.interp(time_s, [0.2, 0.28, 0.36, 0.66, 0.74], [0.0, 0.038, 0.0, 0.0, 0.038])


def signals(pca: float, effects: tuple[Effect, ...]) -> tuple[Array, dict[str, Array]]:
    """Force of the base model, and of each effect, F0."""
    time_s, length = protocol()
    speed = np.gradient(length, time_s)
    level = 1.0 / (1.0 + 10.0 ** (2.5 * (pca - 6.1)))
    base = level * (1.0 + 13.0 * remembered(speed, 0.03) + 4.0 * remembered(speed, 0.25)) + 1.5 * length
    late = np.clip(remembered(np.clip(speed, 0.0, None), 0.05) - 0.012, 0.0, None)
    shapes = {
        "forcible_detachment": -level * late / 0.012,
        "viscous_drag": speed / 0.5,
        "calcium_dependent_elasticity": level * length / 0.038,
        "force_drift": time_s * (1.0 if pca == 6.2 else 0.1),
    }
    return base, {e.name: e.size * shapes[e.name] for e in effects}


def made(fibres: tuple[str, ...], effects: tuple[Effect, ...], unknown_f0: float, seed: int = 1) -> list[TrialTraces]:
    """Traces: the base takes a part of every effect for its own, held-out predictions are a little worse."""
    random = np.random.default_rng(seed)
    out = []
    for k, fibre in enumerate(fibres):
        for pca in PCAS:
            time_s, length = protocol()
            force, added = signals(pca, effects)
            scale = 1.0 + 0.1 * math.sin(3.0 * k)
            total = scale * sum(added.values(), np.zeros_like(force))
            rest = unknown_f0 * np.sin(2.0 * np.pi * 6.0 * time_s) * np.exp(-np.abs(time_s - 0.7) / 0.1)
            noise = lfilter([0.2], [1.0, -0.95], random.normal(0.0, 1.0, time_s.size))
            measured = force + total + rest + NOISE_F0 * noise / rms(noise)
            before, after = force + 0.3 * total, force + 0.94 * total
            level = 0.02 * (1.0 + random.normal(0.0, 0.5)) * force
            out.append(
                TrialTraces(
                    fibre, f"{fibre}_pca{10 * pca:.0f}", time_s, length, measured, 0.93 * force, before, after,
                    before + 0.5 * level - 0.1 * total, after + 0.25 * level,
                    {e.name: after - 0.94 * scale * added[e.name] for e in effects},
                )
            )  # fmt: skip
    return out


def trial_row(t: TrialTraces, pca: float) -> OfTrial:
    left = [t.measured_f0 - f for f in (t.before_f0, t.after_f0, t.heldout_before_f0, t.heldout_after_f0)]
    return OfTrial(t.fibre, t.trial, pca, PHASES, NOISE_F0, "window", 100, *(rms(r) for r in left))


def places(traces: list[TrialTraces], rows: tuple[OfTrial, ...], of: str) -> tuple[Place, ...]:
    """Phases in which the residual exceeds 0.6 % F0, the largest first."""
    found = []
    for t, row in zip(traces, rows, strict=True):
        left = t.measured_f0 - getattr(t, of)
        for name, start, end in PHASES:
            part = left[(t.time_s >= start) & (t.time_s < end)]
            if rms(part) > 0.006:
                found.append(Place(t.fibre, t.trial, name, start, end, rms(part), float(part.mean()), 0.002, row.pca))
    return tuple(sorted(found, key=lambda p: -p.size_f0))


def residual_map(traces: list[TrialTraces], of: str) -> dict[str, dict[str, list[object]]]:
    out: dict[str, dict[str, list[object]]] = {}
    for t in traces:
        table = out.setdefault(
            t.fibre,
            {"trials": [], "phases": [p[0] for p in PHASES], "rms_f0": [], "mean_f0": [], "p_value": [], "counts": []},
        )
        left = t.measured_f0 - getattr(t, of)
        parts = [left[(t.time_s >= start) & (t.time_s < end)] for _, start, end in PHASES]
        table["trials"].append(t.trial)
        table["rms_f0"].append([rms(p) for p in parts])
        table["mean_f0"].append([float(p.mean()) for p in parts])
        table["p_value"].append([0.002 if rms(p) > 0.006 else 0.4 for p in parts])
        table["counts"].append([rms(p) > 0.006 for p in parts])
    return out


def gain_of(traces: list[TrialTraces], without: str) -> HeldOutGain:
    """Over conditions; `without` is a component, or empty for the whole answer."""
    pairs = []
    for t in traces:
        with_it = t.measured_f0 - t.heldout_after_f0
        other = with_it + t.adds_f0(without) if without else t.measured_f0 - t.heldout_before_f0
        pairs.append((rms(other), rms(with_it)))
    logs = np.array([math.log(a / b) for a, b in pairs])
    means = [rms(np.array(column)) for column in zip(*pairs, strict=True)]
    se = float(logs.std(ddof=1) / math.sqrt(logs.size))
    return HeldOutGain(float(logs.mean()), se, "log RMSD ratio", len(PCAS), *means)


def components(
    traces: list[TrialTraces], effects: tuple[Effect, ...], fibres: tuple[str, ...]
) -> tuple[Component, ...]:
    mismatch = rms(np.concatenate([t.measured_f0 - t.before_f0 for t in traces])) ** 2
    out = []
    for e in effects:
        adds = np.concatenate([t.adds_f0(e.name) for t in traces])
        rows = []
        for k, fibre in enumerate(fibres):
            own = [t for t in traces if t.fibre == fibre]
            alone = min(0.99, max(0.02, e.probability - 0.25 * abs(math.sin(2.0 * k + len(e.name)))))
            rows.append(
                OfFibre(fibre, alone, min(1.0, rms(adds) ** 2 / mismatch), gain_of(own, e.name), (e.parameter,))
            )
        share = min(1.0, 0.45 * rms(adds) ** 2 / mismatch)
        out.append(
            Component(
                e.name, e.kind, e.family, e.members, e.probability, share, gain_of(traces, e.name), (e.parameter,),
                e.direction, ("weakly_bound_heads",) if e.name == "viscous_drag" else (), tuple(rows),
            )
        )  # fmt: skip
    for name, kind, family, value in LESS_LIKELY:
        tried = HeldOutGain(0.02 * value, 0.02, "log RMSD ratio", len(PCAS), 0.02, 0.02) if value > 0.1 else None
        rows = [OfFibre(fibre, value, 0.0, None, ()) for fibre in fibres]
        trades = ("viscous_drag",) if name == "weakly_bound_heads" else ()
        out.append(Component(name, kind, family, (name,), value, 0.0, tried, (), "", trades, tuple(rows)))
    return tuple(sorted(out, key=lambda c: -c.inclusion_probability))


def study_rows(traces: list[TrialTraces], effects: tuple[Effect, ...], fibres: tuple[str, ...]) -> tuple[Any, ...]:
    rows = []
    names = tuple(e.name for e in effects)
    for fibre in fibres:
        own = [t for t in traces if t.fibre == fibre]
        scores = [
            Scores(
                names if of == "after" else (),
                rms(np.concatenate([t.measured_f0 - getattr(t, f"{of}_f0") for t in own])),
                rms(np.concatenate([t.measured_f0 - getattr(t, f"heldout_{of}_f0") for t in own])),
            )
            for of in ("before", "after")
        ]
        left_out = (1.1 * scores[0].train_rmsd_f0, 1.3 * scores[1].train_rmsd_f0) if len(fibres) > 1 else None
        base = (("f", 95.0, 103.2, "1/s"), ("k21", 19.0, 22.4, "1/s"), ("kse", 0.33, 0.331, "F0/L0"))
        rows.append(OfStudyFibre(fibre, "3state_coop", len(own), names[:1], *scores, left_out, 0.002, base, 0.004))
    return tuple(rows)


def sample(
    fibres: tuple[str, ...] = ("18Dec2017a",),
    effects: tuple[Effect, ...] = (DETACHMENT, DRAG, DRIFT),
    unknown_f0: float = 0.015,
    verdict: Verdict = Verdict.PHYSICS,
) -> Sample:
    """A record with its traces; what it says of effects is made up, all errors are of the traces."""
    traces = made(fibres, effects, unknown_f0)
    rows = tuple(trial_row(t, PCAS[i % len(PCAS)]) for i, t in enumerate(traces))
    parts = components(traces, effects, fibres)
    named = [c for c in parts if c.inclusion_probability >= 0.5]
    before, after = (
        Scores(
            tuple(c.name for c in named) if of == "after" else (),
            rms(np.concatenate([t.measured_f0 - getattr(t, f"{of}_f0") for t in traces])),
            rms(np.concatenate([t.measured_f0 - getattr(t, f"heldout_{of}_f0") for t in traces])),
        )
        for of in ("before", "after")
    )
    law = Law(
        fibres[0], 0.0118, "activation", 0.42, 0.63, tuple(np.geomspace(0.002, 5.0, 11).tolist()),
        (0.0, 0.002, 0.011, 0.006, 0.0, 0.0, 0.001, 0.0, 0.0, 0.0, 0.0),
        {"constant": 0.31, "calcium": 0.44, "force": 0.6},
    )  # fmt: skip
    names = tuple(c.name for c in named)
    sets = [
        SetOfMechanisms(names, 0.52, 0.0, after.train_rmsd_f0, True),
        SetOfMechanisms(names[:-1], 0.21, -0.9, 1.1 * after.train_rmsd_f0, True),
        SetOfMechanisms((*names, "weakly_bound_heads"), 0.14, -1.3, 0.99 * after.train_rmsd_f0, False),
        SetOfMechanisms((), 1e-5, -11.2, before.train_rmsd_f0, True),
    ]
    nuisances = [
        Nuisance(fibre, "pca_shift", f"pCa {pca:g}", "1", 0.03 * math.sin(9.0 * pca), 0.012, 0.05)
        for fibre in fibres
        for pca in PCAS
    ]
    nuisances += [Nuisance(fibre, "time_shift", "", "s", 4.1e-4, 1.2e-4, 7e-4) for fibre in fibres]
    explained = 1.0 - (after.train_rmsd_f0**2 - NOISE_F0**2) / (before.train_rmsd_f0**2 - NOISE_F0**2)
    mechanisms = tuple(c.name for c in named if c.kind is Kind.MECHANISM)
    d = Diagnosis(
        FORMAT, fibres, "3state_coop", "gaussian", False, 1, 81.2, verdict, mechanisms, parts, explained,
        places(traces, rows, "before_f0"), 0.002, True,
        Remaining(after.train_rmsd_f0, NOISE_F0, places(traces, rows, "after_f0"), law), law, before, after,
        gain_of(traces, ""), 0.7 * (after.heldout_rmsd_f0 or 0.0), tuple(sets),
        study_rows(traces, effects, fibres), rows, tuple(nuisances),
        features=(
            Feature(fibres[0], "SRS", "pCa 6.2, 3.8 % L0, 316 ms", 31.2, 38.4, 32.9, False),
            Feature(fibres[0], "isometric force", "pCa 6.2", 0.41, 0.44, 0.42, True),
        ),
        map_before=residual_map(traces, "before_f0"), map_after=residual_map(traces, "after_f0"),
        next_experiment=NextExperiment(
            "next_experiment", "a stretch by 4 % L0 at 2 L0/s from optimal length at pCa 6.2",
            ("viscous_drag", "weakly_bound_heads"), 0.0083,
        ),
        augmented={fibre: f"augmented/{fibre}.yaml" for fibre in fibres} if mechanisms else {},
        warnings=("the answer predicts 0.9 F0 of passive force at 1.2 L0, outside the study",),
        missing=("a second speed of stretch, to part drag from weakly bound heads",),
        notes=("trial 18Dec2017a_pca66: noise of the other trials",),
    )  # fmt: skip
    return Sample(d, tuple(traces))


def one_fibre() -> Sample:
    """Physics and an artefact in one fibre."""
    return sample()


def five_fibres() -> Sample:
    """Five fibres pooled; a family that cannot be told apart is part of the answer."""
    fibres = ("13Dec2017a", "14Dec2017b", "18Dec2017a", "18Dec2017b", "19Dec2017a")
    return sample(fibres, (DETACHMENT, DRAG, SPRINGS))


def nothing() -> Sample:
    """Nothing is missing; nothing was left out either."""
    found = sample(effects=(), unknown_f0=0.0, verdict=Verdict.NONE)
    d = found.diagnosis
    quiet = replace(
        d, explained_share=0.0, p_value=0.41, base_law=None, remaining=replace(d.remaining, law=None, where=()),
        heldout_gain=None, benchmark_rmsd_f0=None, features=(), next_experiment=None, warnings=(), notes=(),
        missing=(), before=replace(d.before, heldout_rmsd_f0=None), after=replace(d.after, heldout_rmsd_f0=None),
        trials=tuple(replace(t, heldout_before_f0=None, heldout_after_f0=None) for t in d.trials),
    )  # fmt: skip
    return Sample(quiet, tuple(replace(t, heldout_before_f0=None, heldout_after_f0=None) for t in found.traces))


def unexplained() -> Sample:
    """A mismatch for which nothing has evidence."""
    return sample(effects=(), unknown_f0=0.05, verdict=Verdict.UNEXPLAINED)


def ambiguous() -> Sample:
    """Two mechanisms of which neither is sure."""
    weaker = (DRAG._replace(probability=0.63), SPRINGS._replace(probability=0.55))
    return sample(effects=weaker, verdict=Verdict.AMBIGUOUS)


def measurement() -> Sample:
    """An artefact alone."""
    return sample(effects=(DRIFT._replace(probability=0.97, size=0.05),), unknown_f0=0.0, verdict=Verdict.MEASUREMENT)


ALL = {
    "one_fibre": one_fibre, "five_fibres": five_fibres, "nothing": nothing, "unexplained": unexplained,
    "ambiguous": ambiguous, "measurement": measurement,
}  # fmt: skip


def many(fibres: int, trials: int, phases: int, parts: int, long: bool = False) -> Sample:
    """As many of everything as asked for, with short or with long names."""
    random = np.random.default_rng(fibres + trials)
    first = one_fibre()
    d, like = first.diagnosis, first.traces[0]
    names = tuple(("a_muscle_of_some_animal_" if long else "") + f"18Dec2017{k}" for k in range(fibres))
    kinds = [("of_the_long_and_winding_" if long else "") + f"phase_{k}" for k in range(phases)]
    rows, traces = [], []
    maps: list[dict[str, Any]] = [{}, {}]
    components_ = []
    for k in range(parts):
        likeliest = d.components[k % len(d.components)]
        known = d.components[k % 3]
        members = ("static_calcium_stiffness", "thin_filament_cooperativity") if long else likeliest.members
        value = max(0.99 - 0.9 * k / parts, 0.0)
        of = tuple(OfFibre(f, float(random.uniform()), 0.1, known.heldout_gain, ()) for f in names)
        components_.append(
            replace(likeliest, name=f"part_{k}", members=members, inclusion_probability=value, by_fibre=of,
                    heldout_gain=known.heldout_gain)
        )  # fmt: skip
    for fibre in names:
        sizes = 0.05 * random.normal(size=(trials, phases))
        for i in range(trials):
            trial = f"{fibre}_amp383_trial_{i:02d}" + ("_of_very_many_of_the_same_kind" if long else "")
            before = float(random.uniform(0.01, 0.06))
            rows.append(
                OfTrial(fibre, trial, 4.5 + 0.25 * (i % 9), PHASES, 0.001, "window", 99, before, 0.6 * before, before,
                        float(random.uniform(0.5, 1.2)) * before)
            )  # fmt: skip
            shown = {c.name: like.after_f0 - 0.01 * random.normal() for c in components_[:7]}
            traces.append(replace(like, fibre=fibre, trial=trial, without_f0=shown))
        listed = [rows[-trials + i].trial for i in range(trials)]
        for maps_of, scale in zip(maps, (1.0, 0.4), strict=True):
            table = {"trials": listed, "phases": kinds, "rms_f0": (1.2 * scale * np.abs(sizes)).tolist()}
            maps_of[fibre] = {**table, "mean_f0": (scale * sizes).tolist(), "counts": (sizes > 0.05).tolist()}
    study = tuple(replace(d.by_fibre[0], fibre=f, left_out_rmsd_f0=(0.03, 0.02) if fibres > 1 else None) for f in names)
    made_of = replace(
        d, fibres=names, components=tuple(components_), trials=tuple(rows), by_fibre=study, map_before=maps[0],
        map_after=maps[1],
    )  # fmt: skip
    return Sample(made_of, tuple(traces))
