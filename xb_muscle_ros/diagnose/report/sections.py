"""The parts of the page below the verdict: where, how it looks, what it remembers, and what was fitted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from xb_muscle_ros.diagnose.report.conflicts import conflicts
from xb_muscle_ros.diagnose.report.markup import NOTHING, Markup, escaped, named, prose
from xb_muscle_ros.diagnose.sentences import LAW, noise_from
from xb_muscle_ros.diagnose.significance import ALPHA, FLOOR_F0
from xb_muscle_ros.diagnose.words import SCALES, digits, human, percent, phase_words, quantity
from xb_muscle_ros.diagnose.written import Written
from xb_muscle_ros.figures.diagnose_common import after_name, augmented, by_activation
from xb_muscle_ros.figures.diagnose_kernel import draw_kernel
from xb_muscle_ros.figures.diagnose_map import draw_map, framed
from xb_muscle_ros.figures.diagnose_profile import draw_profile
from xb_muscle_ros.figures.diagnose_traces import draw_traces, shaded
from xb_muscle_ros.figures.diagnose_trials import draw_trials

Facts = Mapping[str, Any]

_MOST_ROWS = 20
# Where noise was not taken from a window in which the muscle only holds: mark and words.
_NOISE_FROM = {
    "curve": ("*", "Noise: what smooth curves leave of force, for want of enough time without movement"),
    "differences": ("‡", "Noise: what neighbouring samples do not tell of each other"),
    "others": ("†", "Noise: like that of the other trials"),
}


_NOWHERE = (
    f"No place counts: none is both beyond chance (p < {ALPHA:g}, all places together) and larger than "
    f"{percent(FLOOR_F0)} % F0 for a tenth of a second."
)


def where(page: Markup, written: Written) -> str:
    """Mismatches located, and the map before and after."""
    facts = written.facts
    if not facts["mismatch"]:
        return f"<p>{prose(_NOWHERE)}</p>\n{_map(page, facts)}"
    pca_of = {row["trial"]: row["pca"] for row in facts["trials"]}
    rows = [("", _mismatch(page, row, pca_of)) for row in facts["mismatch"][:_MOST_ROWS]]
    more = len(facts["mismatch"]) - len(rows)
    caption = (
        "Where the base model, with its parameters fitted, differs by more than chance; largest first. Size is the "
        "root mean square there." + (f" {more} smaller ones are in <code>diagnosis.json</code>." if more else "")
    )
    head = ["Phase", "Trial", "pCa", "From–to (s)", "Size (% F<sub>0</sub>)", "Mean (% F<sub>0</sub>)", "p"]
    return f"{_map(page, facts)}\n{page.table(caption, head, rows, words=2)}\n{conflicts(page, facts)}"


def _map(page: Markup, facts: Facts) -> str:
    return page.figure(
        draw_map(facts),
        "Measured minus modelled force in each phase of each trial, from low to high calcium, in % F<sub>0</sub>. "
        f"Upper number and colour: {page.number('mean', 'map')} (orange, +: the fibre pulls harder than the model; "
        f"violet, −: less). Small number: {page.number('root mean square', 'map')}, bold with ± where it is more than "
        f"twice the mean: there the difference goes both ways. {_frames(page, facts)} Hatched: the trial has no such "
        "phase.",
        "Heat map of the residual over trials and phases",
    )


def _frames(page: Markup, facts: Facts) -> str:
    number = page.number(f"p < {ALPHA:g}", "cell_p_value")
    counts = f"beyond chance ({number}, all cells together) and larger than {percent(FLOOR_F0)} % F<sub>0</sub>"
    return f"Heavy frame: {counts}." if framed(facts) else f"Every cell is {counts}, so none is framed."


def _mismatch(page: Markup, row: Facts, pca_of: Mapping[str, Any]) -> list[str]:
    pca, start, end = pca_of.get(row["trial"]), row["start_s"], row["end_s"]
    span = NOTHING if start is None or end is None else page.number(f"{start:.3f}–{end:.3f}", "mismatch")
    sign = "" if not row["mean_f0"] else "+" if row["mean_f0"] > 0.0 else "−"
    mean = None if row["mean_f0"] is None else sign + percent(abs(row["mean_f0"]))
    return [
        NOTHING if row["phase"] is None else named(phase_words(str(row["phase"]))),
        named(row["trial"]),
        NOTHING if pca is None else f"{pca:g}",
        span,
        page.cell(_percent(row["size_f0"]), "mismatch"),
        page.cell(mean, "mismatch"),
        page.cell(_p_value(row["p_value"]), "cell_p_value"),
    ]


def traces(page: Markup, written: Written) -> str:
    """Every trial: length, forces and residuals."""
    residual = page.number("residual", "rmsd")
    if shaded(written.facts, written.traces):
        shade = (
            "Shaded: located mismatch of the base model, + where the fibre pulls harder than the model, − where less, "
            "± where both."
        )
    else:
        shade = "Nothing is shaded, as mismatch of the base model was located nearly everywhere."
    return page.figure(
        draw_traces(written.facts, written.traces),
        "Length (top), force measured (grey) and modelled (middle), and what is left, measured minus modelled force "
        f"({residual}, bottom; same scale in all trials), from low to high calcium. Dashed orange: base model with its "
        f"parameters fitted. Blue: {after_name(written.facts)}, where there is one. {shade}",
        "Measured and modelled force of every trial",
    )


def kernel(page: Markup, written: Written) -> str:
    """The law that what is left follows, if any."""
    found = written.facts["kernel"]
    if found is None:
        return "<p>No memory of the speed of length change was found in what the base model leaves.</p>"
    share = None if found["explained"] is None else page.number(f"{100.0 * found['explained']:.0f} %", "kernel")
    if share is not None and found["explained"] < LAW:
        return (
            "<p>What the base model leaves follows no simple memory of the speed of length change: the best accounts "
            f"for {share} of its mean square.</p>"
        )
    words = []
    if found["time_constant_s"] is not None:
        number = page.number(quantity(1e3 * found["time_constant_s"], "ms"), "kernel")
        words.append(f"Memory of the speed of length change that describes it best: time constant {number}.")
    if found["scales_with"] in SCALES:
        words.append(f"What is left {SCALES[found['scales_with']]}.")
    if found["gain"] is not None:
        words.append(f"Gain: {page.number(digits(found['gain'], 3), 'kernel')}.")
    if share is not None:
        words.append(f"This alone accounts for {share} of the mean square of what is left.")
    caption = (
        f"{page.number('Weights', 'kernel')} of exponential memories of the speed of length change that together "
        "describe what the base model leaves. Dashed: the time constant that sums them up."
    )
    return f"<p>{' '.join(words)}</p>" + page.figure(
        draw_kernel(written.facts), caption, "Weight of exponential memories against their time constant"
    )


def before_after(page: Markup, written: Written) -> str:
    """Error of every trial, in a figure and a table."""
    facts = written.facts
    figure = page.figure(
        draw_trials(facts),
        f"Force RMSD of every trial {page.number('fitted', 'rmsd')} and "
        f"{page.number('left out of the fit', 'heldout_rmsd')}: base model (open), {after_name(facts)} (filled, where "
        f"there is one). Upright bar: {page.number('noise', 'noise')} of the trial. Dotted: what a "
        f"{page.number('flexible curve', 'flexible_bound')} without physics reaches over all trials left out.",
        "Force error of every trial before and after",
    )
    two = augmented(facts)
    rows = [("answer", ["All trials", "", "", *_errors(page, _overall(facts), two)])]
    rows += [("", _trial(page, facts["trials"][i], two)) for i in by_activation(facts["trials"])]
    start = facts["start"]["train_rmsd_f0"]
    given = ""
    if start is not None:
        number = page.number(f"{percent(start)} % F0", "start_rmsd")
        given = f" With the values of the fibre file as it was given, the error over all trials is {number}."
    name = after_name(facts)
    which = f"base model and {name}" if two else "base model"
    marks = "".join(f" {mark} {words}." for source, (mark, words) in _NOISE_FROM.items() if noise_from(facts, source))
    caption = f"Force RMSD of every trial in % F<sub>0</sub>, {which}.{given}{marks}"
    short = name.removesuffix(" model")
    columns = ["Fitted: base", short, "Left out: base", short] if two else ["Fitted", "Left out"]
    return figure + page.table(caption, ["Trial", "pCa", "Noise", *columns], rows)


def _overall(facts: Facts) -> Facts:
    """Errors over all trials under the keys of a trial."""
    before, after = facts["before"], facts["after"]
    return {
        "before_rmsd_f0": before["train_rmsd_f0"],
        "after_rmsd_f0": after["train_rmsd_f0"],
        "heldout_before_f0": before["heldout_rmsd_f0"],
        "heldout_after_f0": after["heldout_rmsd_f0"],
    }


def _trial(page: Markup, row: Facts, two: bool) -> list[str]:
    mark, _ = _NOISE_FROM.get(str(row["noise_from"]), ("", ""))
    return [
        named(row["trial"]),
        NOTHING if row["pca"] is None else f"{row['pca']:g}",
        page.cell(_percent(row["noise_sd_f0"]), "noise") + mark,
        *_errors(page, row, two),
    ]


def _errors(page: Markup, row: Facts, two: bool) -> list[str]:
    """Fitted and left out, of the base model and, where there is one, of the other."""
    cells = []
    for before, after, how in (
        ("before_rmsd_f0", "after_rmsd_f0", "rmsd"),
        ("heldout_before_f0", "heldout_after_f0", "heldout_rmsd"),
    ):
        cells += [page.cell(_percent(row[key]), how) for key in ((before, after) if two else (before,))]
    return cells


def profile(page: Markup, written: Written) -> str:
    """How well the new parameter is determined."""
    found = written.facts["profile"]
    if found is None:
        return ""
    text = ""
    if found["interval"] and None not in found["interval"]:
        low, high = (page.number(quantity(float(v), None), "interval") for v in found["interval"])
        unit = "" if found["unit"] in (None, "", "1") else f" {escaped(found['unit'])}"
        text = f"<p>The recordings put {escaped(found['parameter'])} between {low} and {high}{unit}.</p>"
    return text + page.figure(
        draw_profile(written.facts),
        f"{page.number('Profile', 'profile')} of the new parameter: how much worse the best fit becomes when it is "
        f"held at a value. Dotted: limit for 95 %. Shaded: {page.number('interval', 'interval')}.",
        "Profile of the new parameter",
    )


def estimates(page: Markup, written: Written) -> str:
    """Corrections of the measurement, and the parameters of the base model."""
    facts, out = written.facts, []
    if facts["nuisances"]:
        rows = [("", _nuisance(page, row)) for row in facts["nuisances"]]
        caption = (
            "Corrections of the measurement that were fitted as part of the answer, with the size to expect beforehand."
        )
        out.append(page.table(caption, ["Correction", "Of", "Value ± s.d.", "Expected ±", "Unit"], rows, words=2))
    if facts["base_parameters"]:
        rows = [("", _parameter(page, row)) for row in facts["base_parameters"]]
        caption = "Parameters of the base model: in the fibre file as it was given, and fitted."
        out.append(page.table(caption, ["Parameter", "Given", "Fitted", "Change", "Unit"], rows))
    return "".join(out)


def _nuisance(page: Markup, row: Facts) -> list[str]:
    value = None if row["value"] is None else digits(row["value"], 2)
    if value is not None and row["sd"] is not None:
        value += f" ± {digits(row['sd'], 2)}"
    prior = None if row["prior_sd"] is None else digits(row["prior_sd"], 2)
    return [
        named(human(str(row["name"]))),
        NOTHING if row["group"] is None else named(row["group"]),
        page.cell(value, "nuisances"),
        page.cell(prior, "nuisances"),
        _unit(row["unit"]),
    ]


def _parameter(page: Markup, row: Facts) -> list[str]:
    start, fitted = row["start"], row["fitted"]
    change = None
    if start and fitted is not None:
        change = f"{100.0 * (fitted / start - 1.0):+.0f} %".replace("-", "−")
    return [
        named(row["name"]),
        page.cell(None if start is None else digits(start, 3), "base_parameters"),
        page.cell(None if fitted is None else digits(fitted, 3), "base_parameters"),
        page.cell(change, "base_parameters"),
        _unit(row["unit"]),
    ]


def _unit(unit: str | None) -> str:
    return NOTHING if unit in (None, "", "1") else prose(unit)


def _percent(value_f0: float | None) -> str | None:
    return None if value_f0 is None else percent(value_f0)


def _p_value(value: float | None) -> str | None:
    return None if value is None else f"{value:.2g}"
