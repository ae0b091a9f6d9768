"""What a fit found, as lines for a terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from xb_muscle_ros.fit.ends import PRIOR, closes
from xb_muscle_ros.fit.ordinary import fitted_line, unit_of
from xb_muscle_ros.measurement.artefacts import ARTEFACTS, Scope

# Beyond so many trials their faults have one line of the table.
_MANY = 4


def table(found: Mapping[str, Any]) -> str:
    """Lines for a terminal."""
    lines = [f"{'parameter':24s} {'start':>11s} {'fitted':>11s}  {'interval':25s} unit"]
    kinds = Counter(row["name"] for row in found["parameters"])
    told: set[str] = set()
    for row in found["parameters"]:
        if row["group"] is not None and kinds[row["name"]] > _MANY and ARTEFACTS[row["name"]].scope is Scope.TRIAL:
            if row["name"] not in told:
                values = [r["value"] for r in found["parameters"] if r["name"] == row["name"]]
                spread = f"{min(values):.4g} to {max(values):.4g}"
                lines.append(
                    f"{row['name']:24s} {row['start']:11.5g} {spread:>25s}  of {len(values)} trials {row['unit']}"
                )
            told.add(row["name"])
            continue
        label = f"{row['name']}[{row['group']}]" if row["group"] else row["name"]
        interval = f"{_end(row, 0)} to {_end(row, 1)}"
        lines.append(f"{label:24s} {row['start']:11.5g} {row['value']:11.5g}  {interval:25s} {row['unit']}")
    lines += _held_lines(found)
    lines += ["", f"{'trial':40s} {'':9s} {'before':>8s} {'after':>8s}  RMSD, % F0"]
    for row in found["trials"]:
        what = "held out" if row["held_out"] else "training" if row["weight"] > 0.0 else "no weight"
        line = f"{row['trial']:40s} {what:9s} {_percent(row['rmsd_before_f0'])} {_percent(row['rmsd_f0'])}"
        if row.get("own_faults"):
            own = ", ".join(f"{name} {value:+.3g}{unit_of(name)}" for name, value in row["own_faults"].items())
            both = _both(row["rmsd_before_calibrated_f0"], row["rmsd_calibrated_f0"])
            line += f"; with what its isometric force tells: {both} ({own})"
        lines.append(line)
    for key, what in (("train_rmsd_f0", "training"), ("heldout_rmsd_f0", "held out")):
        if found[key] is not None:
            lines.append(f"{'all':40s} {what:9s} {_percent(found['before'][key])} {_percent(found[key])}")
    if found["heldout_rmsd_calibrated_f0"] is not None:
        key = "heldout_rmsd_calibrated_f0"
        count = sum(bool(row.get("own_faults")) for row in found["trials"])
        both = _both(found["before"][key], found[key])
        lines[-1] += f"; with what isometric force tells of {count} of them: {both}"
    return "\n".join(lines)


def _both(before: float | None, after: float | None) -> str:
    return f"{_percent(before).strip()} before, {_percent(after).strip()} after"


def _end(row: Mapping[str, Any], side: int) -> str:
    """One end of an interval: ``<`` or ``>`` where it is open, ``~`` before one that the prior makes."""
    what = row["interval_ended_by"][side]
    mark = "" if closes(what) else "~" if what == PRIOR else "<>"[side]
    return f"{mark}{row['interval'][side]:.4g}"


def _held_lines(found: Mapping[str, Any]) -> list[str]:
    """What was not fitted, a line for each kind; and what the marks of the intervals say, where there are some."""
    rows = found["parameters"]
    marks = {_end(row, side)[0] for row in rows for side in (0, 1)} & {"<", ">", "~"}
    lines = ["< >: open, no end in the data; ~: the prior's end"] if marks else []
    if any(row["interval_kind"] == "curvature" and row["group"] is None for row in rows):
        lines.append("intervals are those of the curvature at the best point: profiles were left out")
    if found["ties"]:
        lines.append(f"tied: {', '.join(f'{a} = {b}' for a, b in found['ties'].items())}")
    if found["held"]:
        lines.append(f"held at their values: {', '.join(f'{n} {v:.5g}' for n, v in found['held'].items())}")
    fitted = fitted_line(rows)
    lines += [fitted] if fitted else []
    if found["nuisances_not_fitted"]:
        lines.append(f"taken as absent: {', '.join(found['nuisances_not_fitted'])}")
    return lines


def _percent(value: float | None) -> str:
    return f"{'-':>8s}" if value is None else f"{100.0 * value:8.3f}"
