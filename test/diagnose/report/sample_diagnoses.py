"""Records as a diagnosis might make them, with traces that belong to them: the numbers of one follow from the other."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from made_recordings import (
    DETACHMENT,
    DRAG,
    DRIFT,
    NOISE_F0,
    PCAS,
    PHASES,
    SPRINGS,
    Effect,
    made,
    rms,
)

from xb_muscle_ros.diagnose.component import Component, HeldOutGain, Kind, OfFibre
from xb_muscle_ros.diagnose.report.traces import TrialTraces
from xb_muscle_ros.diagnose.residual import AnswerResidual, Place, ResidualLaw, ResidualMap
from xb_muscle_ros.diagnose.result import (
    FORMAT,
    Diagnosis,
    Feature,
    NextExperiment,
    NuisanceParameter,
    OfStudyFibre,
    OfTrial,
    Scores,
    SetOfMechanisms,
    Verdict,
)

Array = Any


class Sample(NamedTuple):
    """A record and its traces."""

    diagnosis: Diagnosis
    traces: tuple[TrialTraces, ...]


LESS_LIKELY = (
    ("weakly_bound_heads", Kind.MECHANISM, "weak_binding", 0.34), ("nonlinear_crossbridge", Kind.MECHANISM,
    "heads_under_strain", 0.22), ("half_sarcomere_spread", Kind.MECHANISM, "heterogeneity", 0.11), ("pca_shift",
    Kind.ARTEFACT, "calcium_of_solutions", 0.06), ("lattice_spacing", Kind.MECHANISM, "length_dependence", 0.031),
    ("phosphate", Kind.MECHANISM, "rates", 0.008), ("transducer_lag", Kind.ARTEFACT, "timing", 0.004),
)  # fmt: skip


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


def residual_map(traces: list[TrialTraces], of: str) -> dict[str, ResidualMap]:
    out = {}
    for fibre in dict.fromkeys(t.fibre for t in traces):
        own = [t for t in traces if t.fibre == fibre]
        rows = []
        for t in own:
            left = t.measured_f0 - getattr(t, of)
            rows.append([left[(t.time_s >= start) & (t.time_s < end)] for _, start, end in PHASES])
        out[fibre] = ResidualMap(
            tuple(t.trial for t in own),
            tuple(p[0] for p in PHASES),
            tuple(tuple(rms(p) for p in parts) for parts in rows),
            tuple(tuple(float(p.mean()) for p in parts) for parts in rows),
            tuple(tuple(0.002 if rms(p) > 0.006 else 0.4 for p in parts) for parts in rows),
            tuple(tuple(rms(p) > 0.006 for p in parts) for parts in rows),
        )
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
            again = 10.0 * (alone - 0.4) if len(fibres) > 1 else None
            share = min(1.0, rms(adds) ** 2 / mismatch)
            rows.append(OfFibre(fibre, alone, share, gain_of(own, e.name), (e.parameter,), again))
        share = min(1.0, 0.45 * rms(adds) ** 2 / mismatch)
        out.append(
            Component(
                e.name, e.kind, e.family, e.members, e.probability, share, gain_of(traces, e.name),
                (e.parameter if len(fibres) > 1 else replace(e.parameter, spread=None),),
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
    left = ResidualLaw(fibres[0], 0.087, "force", 0.11, 0.38, tuple(np.geomspace(0.002, 5.0, 11).tolist()),
               (0.0, 0.0, 0.001, 0.0, 0.004, 0.003, 0.0, 0.0, 0.0, 0.001, 0.0), {"constant": 0.2})  # fmt: skip
    law = ResidualLaw(
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
        NuisanceParameter(fibre, "pca_shift", f"pCa {pca:g}", "1", 0.03 * math.sin(9.0 * pca), 0.012, 0.05)
        for fibre in fibres
        for pca in PCAS
    ]
    nuisances += [NuisanceParameter(fibre, "time_shift", "", "s", 4.1e-4, 1.2e-4, 7e-4) for fibre in fibres]
    explained = 1.0 - (after.train_rmsd_f0**2 - NOISE_F0**2) / (before.train_rmsd_f0**2 - NOISE_F0**2)
    mechanisms = tuple(c.name for c in named if c.kind is Kind.MECHANISM)
    d = Diagnosis(
        FORMAT, fibres, "3state_coop", "gaussian", False, 1, 81.2, verdict, mechanisms, parts, explained,
        places(traces, rows, "before_f0"), 0.002, True,
        AnswerResidual(after.train_rmsd_f0, NOISE_F0, places(traces, rows, "after_f0"), left if effects else law),
        law, before, after,
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
        d, explained_fraction=0.0, p_value=0.41, base_law=None, residual=replace(d.residual, law=None, places=()),
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
