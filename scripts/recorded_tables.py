"""Tables of the page of the recordings, as Markdown."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from xb_muscle_ros.diagnose.component import NAMED, OfFibre
from xb_muscle_ros.diagnose.report import phrases as say
from xb_muscle_ros.diagnose.residual import Place
from xb_muscle_ros.diagnose.result import Diagnosis
from xb_muscle_ros.tables import markdown

_PLACES, _SETS, _COMPONENTS = 6, 8, 8
# Components less probable than this are counted only.
_LEAST = 0.05


def force(value_f0: float | None) -> str:
    """A force in % F0, without the unit."""
    return say.NOTHING if value_f0 is None or not math.isfinite(value_f0) else f"{100.0 * value_f0:.2f}"


probability = say.probability


def components(d: Diagnosis) -> str:
    """Components with evidence, the most probable first; the first ones where there is none."""
    likely = [c for c in d.components if c.inclusion_probability >= _LEAST][:_COMPONENTS]
    shown = likely or list(d.components[:3])
    heads = [
        "component",
        "kind",
        "probability",
        "ablation loss",
        "held-out gain",
        "parameters (95 %)",
        "direction",
        "rivals",
    ]
    cells = []
    for c in shown:
        told = "; ".join(f"{p.name} {say.estimate(p)}{' at bound' if p.at_bound else ''}" for p in c.parameters)
        name = c.members[0] if len(c.members) == 1 else f"{c.name}: {' or '.join(c.members)}"
        share = say.share(c.ablation_loss) if c.inclusion_probability >= NAMED else say.NOTHING
        cells.append(
            [
                name, c.kind.value, probability(c.inclusion_probability), share, say.gain(c.heldout_gain),
                told or say.NOTHING, c.direction or say.NOTHING, ", ".join(c.not_separable_from) or say.NOTHING,
            ]
        )  # fmt: skip
    left = len(d.components) - len(shown)
    return markdown(heads, cells) + (f"\n\n{left} further candidates are less probable." if left else "")


def fibres(d: Diagnosis) -> str:
    """Each fibre of a study: what it says alone, and how the common answer does in it."""
    names = d.named
    heads = ["fibre", "named by it alone", *(f"{c.members[0]}: by it alone; log Bayes factor" for c in names)]
    heads += ["RMSD", "held out", "fibre left out"]
    cells = []
    for i, row in enumerate(d.by_fibre):
        left = row.left_out_rmsd_f0
        cells.append(
            [
                row.fibre,
                ", ".join(row.answer) or say.NOTHING,
                *(_of_fibre(c.by_fibre[i]) for c in names),
                f"{force(row.before.train_rmsd_f0)} → {force(row.after.train_rmsd_f0)}",
                f"{force(row.before.heldout_rmsd_f0)} → {force(row.after.heldout_rmsd_f0)}",
                say.NOTHING if left is None else f"{force(left[0])} → {force(left[1])}",
            ]
        )
    return markdown(heads, cells)


def _of_fibre(row: OfFibre) -> str:
    told = say.NOTHING if row.replication is None else f"{row.replication:+.1f}".replace("-", "−")
    return f"{probability(row.inclusion_probability)}; {told}"


def places(found: Sequence[Place]) -> str:
    """The largest cells of a residual."""
    if not found:
        return "nowhere by more than noise."
    several = len({m.fibre for m in found}) > 1
    rows = [
        [
            f"{m.fibre} {m.trial}" if several else m.trial, m.phase, f"{m.start_s:.2f}–{m.end_s:.2f}",
            force(m.size_f0), force(m.mean_f0),
        ]
        for m in found[:_PLACES]
    ]  # fmt: skip
    return markdown(["trial", "phase", "time (s)", "size", "mean, measured less model"], rows)


def feature_scores(d: Diagnosis) -> str:
    """Relative SRS at conditions that no trace has."""
    rows = [[f.reading, f.conditions, str(f.count), f"{f.before:.3f}", f"{f.after:.3f}"] for f in d.feature_scores]
    return markdown(["reading", "reductions", "conditions", "base", "answer"], rows)


def sets(d: Diagnosis) -> str:
    """The most probable sets, and the base."""
    rows = list(d.sets[:_SETS])
    rows += [s for s in d.sets[_SETS:] if not s.names]
    cells = [
        [
            " + ".join(s.names) or "base", probability(s.probability), f"{s.log_evidence:.1f}", force(s.rmsd_f0),
            "yes" if s.fitted else "no",
        ]
        for s in rows
    ]  # fmt: skip
    return markdown(["set", "probability", "log evidence", "RMSD", "fitted"], cells)


def predicted_rows(folder: Path) -> list[dict[str, Any]]:
    """Rows of the held-out trials in ``predictions.json``, also of its former formats."""
    tree = json.loads((folder / "predictions.json").read_text(encoding="utf-8"))
    rows: list[dict[str, Any]] = next(tree[key] for key in ("held_out", "heldout", "concealed") if key in tree)
    return rows


def held_out(rows: Sequence[Mapping[str, Any]]) -> str:
    """How held-out trials are predicted."""
    answered = any("after" in row["rmsd_f0"] for row in rows)
    heads = ["tests", "trial", "base"]
    heads += ["answer", "better", "warned beforehand"] if answered else []
    heads += ["pCa shift", "offset (% F0)", "end: measured / base" + (" / answer" if answered else "")]
    models = ("before", "after") if answered else ("before",)
    cells = []
    for row in rows:
        before, after = row["rmsd_f0"]["before"], row["rmsd_f0"].get("after")
        line = [row["tests"], row["trial"], force(before)]
        if answered:
            better = after is not None and (before is None or after < before)
            line += [force(after), "yes" if better else "no", "yes" if row["warned"] else "no"]
        shift = [row["own"].get(m, {}).get("pca_shift") for m in models]
        offset = [row["own"].get(m, {}).get("force_offset") for m in models]
        line += [" / ".join(say.NOTHING if x is None else f"{x:+.3f}" for x in shift)]
        line += [" / ".join(map(force, offset))]
        line += [" / ".join(force(row["end_f0"].get(m)) for m in ("measured", *models))]
        cells.append(line)
    return markdown(heads, [*cells, _total(rows, models, len(heads))])


def _total(rows: Sequence[Mapping[str, Any]], models: Sequence[str], width: int) -> list[str]:
    """Root mean square over the trials; nothing where one has no solution."""
    line = ["all", ""]
    for name in models:
        values = [row["rmsd_f0"].get(name) for row in rows]
        known = [v for v in values if v is not None]
        line.append(force(math.sqrt(sum(v**2 for v in known) / len(known))) if len(known) == len(values) else "–")
    if len(models) > 1:
        pairs = [(row["rmsd_f0"]["before"], row["rmsd_f0"].get("after")) for row in rows]
        line.append(f"{sum(b is not None and a is not None and a < b for b, a in pairs)} of {len(pairs)}")
    return [*line, *[""] * (width - len(line))]
