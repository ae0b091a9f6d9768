"""``evaluate.md``: the tables that a reader looks at first."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from xb_muscle_ros.evaluate.paper import NEED_RECORDINGS
from xb_muscle_ros.evaluate.sections import left_out_lines
from xb_muscle_ros.evaluate.trials import WINDOWS
from xb_muscle_ros.scores.conditions import SETS
from xb_muscle_ros.tables import NOTHING, markdown, number, with_error

_READING_TEXT = {
    "text": "as the paper's text defines it: SRS relative to the reference trial, large reductions at low and "
    "intermediate activation",
    "released": "as the authors' public programs compute it: SRS relative to the conditioning stretch of 3.83 % L0, "
    "large reductions at all activations",
}
_QUANTITY_TEXT = {
    "srs_rmsd.large": "SRS RMSD, large reductions",
    "srs_rmsd.small": "SRS RMSD, small reductions",
    "srs_rmsd.all": "SRS RMSD, all 84 conditions",
    "profile.activation": "SRS RMSD along activation",
    "profile.amplitude": "SRS RMSD along amplitude",
    "profile.recovery": "SRS RMSD along recovery",
    "reduction.mean": "mean reduction of SRS, AMP > 3 % L0 and RT < 0.5 s",
    "k_tr": "k_tr at pCa 4.5, 1/s",
}
_SLICE_TEXT = {"pca": "pCa", "amplitude_l0": "amplitude (L0)", "recovery_s": "recovery time (s)"}
_MOST_ROWS = 60


def write_up(sections: Mapping[str, Any]) -> str:
    """All sections as Markdown."""
    parts = ["# Evaluation", _sets(sections["sets"])]
    if "trials" in sections:
        parts.append(_trials(sections["trials"]))
    if "force_rmsd" in sections and sections["force_rmsd"]["overall"]:
        parts.append(_force(sections["force_rmsd"]))
    if "paper" in sections:
        parts += _paper(sections["paper"])
    for key, title in (("srs", "Relative SRS"), ("srs_of_recordings", "Relative SRS of the recordings")):
        if key in sections:
            parts += _srs(sections[key], title)
    parts += [text for text in (_force_pca(sections), _k_tr(sections), _enhancement(sections)) if text]
    if sections.get("notes"):
        parts.append("## What is missing\n\n" + "\n".join(f"- {line}" for line in sections["notes"]))
    return "\n\n".join(part for part in parts if part) + "\n"


def comparison_table(paper: Mapping[str, Any]) -> str:
    """Ours, the authors' released output, and the paper, for every number that the paper gives; remarks below."""
    columns = [(source, reading) for source in paper["sources"] for reading in paper["readings_shown"]]
    remarks = list(dict.fromkeys(entry["remark"] for entry in paper["comparison"] if entry["remark"]))
    rows, before = [], ""
    for entry in paper["comparison"]:
        quantity = _QUANTITY_TEXT[entry["quantity"]]
        note = f" [{remarks.index(entry['remark']) + 1}]" if entry["remark"] else ""
        cells = ["" if quantity == before else quantity, entry["model"] + note, entry["paper"]]
        for source, reading in columns:
            mark = {True: " =", False: " ≠", None: ""}[entry["agrees"][source][reading]]
            cells.append(number(entry["values"][source][reading]) + mark)
        rows.append(cells)
        before = quantity
    head = ["quantity", "model", "paper", *(f"{source} ({reading})" for source, reading in columns)]
    notes = [f"[{k}] {remark}" for k, remark in enumerate(remarks, start=1)]
    return markdown(head, rows) + "\n\n" + "  \n".join(notes)


def force_table(section: Mapping[str, Any]) -> str:
    """Force RMSD by model and window, % F0, mean ± s.d. of fibre means."""
    rows = []
    for name, found in section["overall"].items():
        whole = found["whole"]
        rows.append(
            [
                name,
                str(len(whole["fibres"])) if whole else "0",
                str(whole["trials"]) if whole else "0",
                *(_percent(found[window]) for window in WINDOWS),
            ]
        )
    return markdown(["model", "fibres", "trials", "whole (% F0)", "conditioning (% F0)", "test (% F0)"], rows)


def srs_table_text(section: Mapping[str, Any], reading: str) -> str:
    """SRS RMSD and AIC by model under one reading."""
    relative = section["aic_relative_to"]
    head = ["model", "fibres", *(f"{name} reductions" if name != "all" else "all" for name in SETS), "conditions"]
    head += [f"AIC - AIC({relative})" if relative else "AIC", "activation", "amplitude", "recovery"]
    rows = []
    for name, found in section["models"].items():
        here = found[reading]
        conditions = "+".join(str(here["conditions"][s]) for s in SETS[:2])
        rmsd, profiles = [number(here["rmsd"][s]) for s in SETS], map(number, here["profile_rmsd"].values())
        rows.append(
            [name, str(len(found["fibres"])), *rmsd, conditions, number(here["relative_aic"], ".1f"), *profiles]
        )
    return markdown(head, rows)


def readings_with_conditions(section: Mapping[str, Any]) -> list[str]:
    """Readings under which there is any condition to compare; recordings without reference trials leave one out."""
    models = section["models"].values()
    return [name for name in section["readings"] if any(found[name]["conditions"]["all"] for found in models)]


def _sets(sets: Sequence[Mapping[str, Any]]) -> str:
    if not sets:
        return ""
    rows = []
    for each in sets:
        how = sorted(set(each["obtained"].values()))
        told = how[0] if len(how) == 1 else "; ".join(f"{fibre}: {text}" for fibre, text in each["obtained"].items())
        missing = ", ".join(each["missing"]) or NOTHING
        rows.append([each["model"], str(len(each["obtained"])), missing, str(each["fitted_parameters"]), told])
    head = ["parameter set", "fibres", "missing for", "fitted parameters", "how it was obtained"]
    return "## Parameter sets\n\n" + markdown(head, rows)


def _trials(section: Mapping[str, Any]) -> str:
    lines = [f"## Recordings\n\nTrials: {section['used']}; fibres: {', '.join(section['fibres'])}."]
    lines += [f"- left out: {line}" for line in section["left_out"]]
    lines += [f"- no parameter set {name} for {', '.join(fibres)}" for name, fibres in section["missing"].items()]
    return "\n".join(lines)


def _force(section: Mapping[str, Any]) -> str:
    parts = ["## Force RMSD\n\nFibre means, mean ± s.d. over fibres.", force_table(section)]
    common = section["common_condition"]
    for varied, entries in section["slices"].items():
        if len(entries) < 2:
            continue
        at = ", ".join(f"{_SLICE_TEXT[name]} {value:g}" for name, value in common.items() if name != varied)
        head = [_SLICE_TEXT[varied], *section["overall"]]
        rows = [
            [f"{e['level']:g}", *(_percent(e["models"].get(name, {}).get("whole")) for name in section["overall"])]
            for e in entries
        ]
        parts.append(f"Whole protocol at {at}, % F0:\n\n{markdown(head, rows[:_MOST_ROWS])}")
    tests = section["paired_t_tests"]
    if tests["comparisons"]:
        rows = [
            [
                f"{t['first']} → {t['second']}",
                t["window"],
                str(t["n"]),
                number(None if t["difference"] is None else 100.0 * t["difference"], ".3f"),
                number(t["t"], ".2f"),
                number(t["p"], ".2g"),
                {True: "yes", False: "no", None: NOTHING}[t["significant"]],
            ]
            for t in tests["comparisons"]
        ]
        head = ["models", "window", "fibres", "difference (% F0)", "t", "p", "significant"]
        note = f"Paired t-tests between neighbours in complexity; p below {tests['threshold']:.2g} (Bonferroni) counts."
        parts.append(f"{note}\n\n{markdown(head, rows)}")
    return "\n\n".join(parts)


def _srs(section: Mapping[str, Any], title: str) -> Iterator[str]:
    shown = readings_with_conditions(section)
    yield f"## {title}" if shown else f"## {title}\n\nNo trial is one of the paper's 84 conditions."
    for reading in shown:
        yield f"RMSD {_READING_TEXT[reading]}:\n\n{srs_table_text(section, reading)}"
    yield from (f"{line}." for line in left_out_lines(section))
    if shown and section["aic_note"]:
        yield section["aic_note"] + "."


def _paper(section: Mapping[str, Any]) -> Iterator[str]:
    yield "## Beside the paper\n\n" + "\n".join(
        f"- ({name}) {_READING_TEXT[name]}" for name in section["readings_shown"]
    )
    yield comparison_table(section)
    yield "= the paper's number to 0.01, or within its bound; ≠ not."
    if not section["recordings"]:
        yield f"Not computed: {NEED_RECORDINGS}."
    head = ["model", "averaging", "unconditioned", "classes", "large set", *SETS]
    rows = [
        [r["model"], r["averaging"], r["unconditioned"], r["classes"], r["large"]]
        + [number(r[f"rmsd_{name}"]) for name in SETS]
        for r in section["readings"]
        if r["source"] == section["sources"][0]
        and r["large"] == {"reference": "text", "conditioning": "released"}[r["unconditioned"]]
    ]
    title = f"### Other readings of the averages ({section['sources'][0]})"
    yield f"{title}\n\nAll sources and readings are in `srs_rmsd.csv`.\n\n{markdown(head, rows)}"


def _force_pca(sections: Mapping[str, Any]) -> str:
    rows = [
        [
            r["fibre"],
            r["of"],
            with_error(r["pca50"], r["pca50_se"]),
            with_error(r["n_hill"], r["n_hill_se"], ".2f"),
            *(number(r[key]) for key in ("passive_f0", "maximal_f0", "rmsd_f0")),
            number(r["points"], "d"),
        ]
        for r in sections["force_pca"]
    ]
    head = [
        "fibre",
        "of",
        "pCa50 ± SE",
        "Hill coefficient ± SE",
        "passive (F0)",
        "maximal (F0)",
        "RMSD (F0)",
        "pCa levels",
    ]
    return "## Isometric force against pCa\n\n" + markdown(head, rows) if rows else ""


def _k_tr(sections: Mapping[str, Any]) -> str:
    rows = [
        [r["fibre"], r["trial"], number(r["pca"], "g"), r["of"], with_error(r["k_per_s"], r["se_per_s"], ".2f")]
        for r in sections["k_tr"]
    ]
    if not rows:
        return ""
    text = "## Rate of force redevelopment\n\n" + markdown(
        ["fibre", "trial", "pCa", "of", "k_tr ± SE, 1/s"], rows[:_MOST_ROWS]
    )
    return text + (f"\n\n{len(rows) - _MOST_ROWS} more in evaluate.json." if len(rows) > _MOST_ROWS else "")


def _enhancement(sections: Mapping[str, Any]) -> str:
    rows = [
        [
            r["stretched"],
            r["isometric"],
            f"{100.0 * r['stretch_l0']:.1f}",
            r["of"],
            *(number(r[key]) for key in ("stretched_f0", "isometric_f0")),
            with_error(r["enhancement_f0"], r["enhancement_se_f0"]),
            with_error(_times(r["relative"], 100.0), _times(r["relative_se"], 100.0), ".1f"),
        ]
        for r in sections["residual_force_enhancement"]
    ]
    head = ["stretched", "isometric", "stretch (% L0)", "of", "force (F0)", "isometric (F0)"]
    head += ["enhancement ± SE (F0)", "% ± SE"]
    if not rows:
        return ""
    after = sections["enhancement_after_s"]
    title = f"## Residual force enhancement, {after:g} s after the stretch"
    note = (
        "Each beside one isometric trial. The standard error is that of the noise; what a muscle does differently from "
        "one trial to the next is not in it."
    )
    return f"{title}\n\n{note}\n\n{markdown(head, rows[:_MOST_ROWS])}"


def _percent(held: Mapping[str, Any] | None) -> str:
    if not held:
        return NOTHING
    return number(held["mean"], ".2f", 100.0) + ("" if held["sd"] is None else f" ± {100.0 * held['sd']:.2f}")


def _times(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value
