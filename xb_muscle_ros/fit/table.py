"""What a fit found, as lines for a terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from xb_muscle_ros.fit.ends import DATA, PRIOR
from xb_muscle_ros.fit.ordinary import fitted_line, unit_of
from xb_muscle_ros.measurement.artefacts import ARTEFACTS, Scope
from xb_muscle_ros.tables import aligned, number

# Beyond so many trials their faults have one line of the table.
_MANY = 4


def table(found: Mapping[str, Any]) -> str:
    """Parameters, what was held, and trials, as lines for a terminal."""
    head = ("parameter", "start", "fitted", "interval", "unit")
    parameters = aligned(head, list(_parameter_rows(found["parameters"])), left=(0, 3, 4), rule=False)
    trials = aligned(("trial", "", "before", "after", "RMSD, % F0"), _trial_rows(found), left=(0, 1, 4), rule=False)
    return "\n".join([parameters, *_held_lines(found), "", trials])


def _parameter_rows(parameters: Sequence[Mapping[str, Any]]) -> Iterator[list[str]]:
    kinds = Counter(row["name"] for row in parameters)
    listed: set[str] = set()
    for row in parameters:
        name = row["name"]
        if row["group"] is not None and kinds[name] > _MANY and ARTEFACTS[name].scope is Scope.TRIAL:
            if name not in listed:
                values = [r["value"] for r in parameters if r["name"] == name]
                spread = f"{min(values):.4g} to {max(values):.4g}"
                yield [name, f"{row['start']:.5g}", "", f"{spread} of {len(values)} trials", row["unit"]]
            listed.add(name)
            continue
        label = f"{name}[{row['group']}]" if row["group"] else name
        interval = f"{_end(row, 0)} to {_end(row, 1)}"
        yield [label, f"{row['start']:.5g}", f"{row['value']:.5g}", interval, row["unit"]]


def _trial_rows(found: Mapping[str, Any]) -> list[list[str]]:
    rows = []
    for row in found["trials"]:
        what = "held out" if row["held_out"] else "training" if row["weight"] > 0.0 else "no weight"
        told = ""
        if row.get("own_faults"):
            own = ", ".join(f"{name} {value:+.3g}{unit_of(name)}" for name, value in row["own_faults"].items())
            both = _both(row["rmsd_before_calibrated_f0"], row["rmsd_calibrated_f0"])
            told = f"with what its isometric force tells: {both} ({own})"
        rows.append([row["trial"], what, _percent(row["rmsd_before_f0"]), _percent(row["rmsd_f0"]), told])
    for key, what in (("train_rmsd_f0", "training"), ("heldout_rmsd_f0", "held out")):
        if found[key] is not None:
            rows.append(["all", what, _percent(found["before"][key]), _percent(found[key]), ""])
    if found["heldout_rmsd_calibrated_f0"] is not None:
        key = "heldout_rmsd_calibrated_f0"
        count = sum(bool(row.get("own_faults")) for row in found["trials"])
        both = _both(found["before"][key], found[key])
        rows[-1][-1] = f"with what isometric force tells of {count} of them: {both}"
    return rows


def _both(before: float | None, after: float | None) -> str:
    return f"{_percent(before)} before, {_percent(after)} after"


def _end(row: Mapping[str, Any], side: int) -> str:
    """One end of an interval: ``<`` or ``>`` where it is open, ``~`` before one that the prior makes."""
    what = row["interval_ended_by"][side]
    mark = "" if what == DATA else "~" if what == PRIOR else "<>"[side]
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
    return number(value, ".3f", 100.0)
