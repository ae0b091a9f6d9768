"""Records with as many fibres, trials, phases and components as asked for."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from made_recordings import PHASES
from sample_diagnoses import Sample, one_fibre

from xb_muscle_ros.diagnose.component import OfFibre
from xb_muscle_ros.diagnose.residual import ResidualMap
from xb_muscle_ros.diagnose.result import OfTrial


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
            rms, mean, p = (tuple(map(tuple, (v * scale * sizes).tolist())) for v in (1.2 * np.sign(sizes), 1.0, 0.0))
            counts = tuple(map(tuple, (sizes > 0.05).tolist()))
            maps_of[fibre] = ResidualMap(tuple(listed), tuple(kinds), rms, mean, p, counts)
    study = tuple(replace(d.by_fibre[0], fibre=f, left_out_rmsd_f0=(0.03, 0.02) if fibres > 1 else None) for f in names)
    made_of = replace(
        d, fibres=names, components=tuple(components_), trials=tuple(rows), by_fibre=study, map_before=maps[0],
        map_after=maps[1],
    )  # fmt: skip
    return Sample(made_of, tuple(traces))
