"""``evaluate.md``: the tables that a reader looks at first."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

from xb_muscle_ros.evaluate.curves import ForcePcaRow, RedevelopmentRow
from xb_muscle_ros.evaluate.enhancement import EnhancementRow
from xb_muscle_ros.evaluate.force_scores import ForceScores, PairedTest, Spread
from xb_muscle_ros.evaluate.paper import NEED_RECORDINGS, PaperSection, ReadingRow
from xb_muscle_ros.evaluate.results import Sections
from xb_muscle_ros.evaluate.sections import SetSection, SrsSection, TrialsSection, left_out_lines
from xb_muscle_ros.evaluate.trials import WINDOWS
from xb_muscle_ros.scores.conditions import SETS
from xb_muscle_ros.scores.enhancement import Enhancement
from xb_muscle_ros.scores.estimate import Missing
from xb_muscle_ros.scores.force_pca import ForcePca
from xb_muscle_ros.tables import NOTHING, Columns, filled, markdown, number, with_error

T = TypeVar("T")
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


def write_up(found: Sections) -> str:
    """All sections as Markdown."""
    parts = ["# Evaluation", *_sets(found.sets)]
    if found.trials is not None:
        parts.append(_trials(found.trials))
    if found.force_rmsd is not None and found.force_rmsd.overall:
        parts += _force(found.force_rmsd)
    if found.paper is not None:
        parts += _paper(found.paper)
    for section, title in ((found.srs, "Relative SRS"), (found.srs_of_recordings, "Relative SRS of the recordings")):
        parts += [] if section is None else _srs(section, title)
    parts += [*_force_pca(found.force_pca), *_k_tr(found.k_tr), *_enhancement(found)]
    if found.notes:
        parts.append("## What is missing\n\n" + "\n".join(f"- {line}" for line in found.notes))
    return "\n\n".join(parts) + "\n"


def comparison_table(paper: PaperSection) -> str:
    """Ours, the authors' released output, and the paper, for every number that the paper gives; remarks below."""
    columns = [(source, reading) for source in paper.sources for reading in paper.readings_shown]
    remarks = list(dict.fromkeys(entry.remark for entry in paper.comparison if entry.remark))
    rows, before = [], ""
    for entry in paper.comparison:
        quantity = _QUANTITY_TEXT[entry.quantity]
        note = f" [{remarks.index(entry.remark) + 1}]" if entry.remark else ""
        cells = ["" if quantity == before else quantity, entry.model + note, entry.paper]
        for source, reading in columns:
            mark = {True: " =", False: " ≠", None: ""}[entry.agrees[source][reading]]
            cells.append(number(entry.values[source][reading]) + mark)
        rows.append(cells)
        before = quantity
    head = ["quantity", "model", "paper", *(f"{source} ({reading})" for source, reading in columns)]
    notes = [f"[{k}] {remark}" for k, remark in enumerate(remarks, start=1)]
    return markdown(head, rows) + "\n\n" + "  \n".join(notes)


def force_table(scores: ForceScores) -> str:
    """Force RMSD by model and window, % F0, mean ± s.d. of fibre means."""
    rows = []
    for name, found in scores.overall.items():
        whole = found["whole"]
        counts = [len(whole.fibres), whole.trials] if whole else [0, 0]
        rows.append([name, *map(str, counts), *(_percent(found[window]) for window in WINDOWS)])
    return markdown(["model", "fibres", "trials", *(f"{window} (% F0)" for window in WINDOWS)], rows)


def srs_table_text(section: SrsSection, reading: str) -> str:
    """SRS RMSD and AIC by model under one reading."""
    relative = section.aic_relative_to
    head = ["model", "fibres", *(f"{name} reductions" if name != "all" else "all" for name in SETS), "conditions"]
    head += [f"AIC - AIC({relative})" if relative else "AIC", "activation", "amplitude", "recovery"]
    rows = []
    for name, found in section.models.items():
        here = found.under[reading]
        conditions = "+".join(str(here.conditions[s]) for s in SETS[:2])
        rmsd, profiles = [number(here.rmsd[s]) for s in SETS], map(number, here.profile_rmsd.values())
        rows.append([name, str(len(found.fibres)), *rmsd, conditions, number(here.relative_aic, ".1f"), *profiles])
    return markdown(head, rows)


def _table(columns: Columns[T], records: Sequence[T]) -> str:
    """At most so many rows, and how many more there are."""
    text = markdown(*filled(columns, records[:_MOST_ROWS]))
    more = len(records) - _MOST_ROWS
    return text + (f"\n\n{more} more in evaluate.json." if more > 0 else "")


def _obtained(each: SetSection) -> str:
    how = set(each.obtained.values())
    return how.pop() if len(how) == 1 else "; ".join(f"{fibre}: {text}" for fibre, text in each.obtained.items())


def _sets(sets: Sequence[SetSection]) -> Iterator[str]:
    columns: Columns[SetSection] = {
        "parameter set": lambda each: each.model,
        "fibres": lambda each: str(len(each.obtained)),
        "missing for": lambda each: ", ".join(each.missing) or NOTHING,
        "fitted parameters": lambda each: str(each.fitted_parameters),
        "how it was obtained": _obtained,
    }
    if sets:
        yield f"## Parameter sets\n\n{markdown(*filled(columns, sets))}"


def _trials(section: TrialsSection) -> str:
    lines = [f"## Recordings\n\nTrials: {section.used}; fibres: {', '.join(section.fibres)}."]
    lines += [f"- left out: {line}" for line in section.left_out]
    lines += [f"- no parameter set {name} for {', '.join(fibres)}" for name, fibres in section.missing.items()]
    return "\n".join(lines)


def _force(scores: ForceScores) -> Iterator[str]:
    yield "## Force RMSD\n\nFibre means, mean ± s.d. over fibres."
    yield force_table(scores)
    for varied, entries in scores.slices.items():
        if len(entries) > 1:
            common = scores.common_condition.items()
            at = ", ".join(f"{_SLICE_TEXT[name]} {value:g}" for name, value in common if name != varied)
            rows = [
                [f"{each.level:g}", *(_percent(each.models[name]["whole"]) for name in scores.overall)]
                for each in entries[:_MOST_ROWS]
            ]
            table = markdown([_SLICE_TEXT[varied], *scores.overall], rows)
            yield f"Whole protocol at {at}, % F0:\n\n{table}"
    tests = scores.paired_t_tests
    of_tests: Columns[PairedTest] = {
        "models": lambda t: f"{t.first} → {t.second}",
        "window": lambda t: t.window,
        "fibres": lambda t: str(t.found.n),
        "difference (% F0)": lambda t: number(t.found.difference, ".3f", 100.0),
        "t": lambda t: number(t.found.t, ".2f"),
        "p": lambda t: number(t.found.p, ".2g"),
        "significant": lambda t: {True: "yes", False: "no", None: NOTHING}[t.significant],
    }
    if tests.comparisons:
        yield f"Paired t-tests between neighbours in complexity; p below {tests.threshold:.2g} (Bonferroni) counts."
        yield markdown(*filled(of_tests, tests.comparisons))


def _srs(section: SrsSection, title: str) -> Iterator[str]:
    yield f"## {title}" if section.shown else f"## {title}\n\nNo trial is one of the paper's 84 conditions."
    for reading in section.shown:
        yield f"RMSD {_READING_TEXT[reading]}:\n\n{srs_table_text(section, reading)}"
    yield from (f"{line}." for line in left_out_lines(section))
    if section.shown and section.aic_note:
        yield section.aic_note + "."


def _paper(section: PaperSection) -> Iterator[str]:
    yield "## Beside the paper\n\n" + "\n".join(f"- ({name}) {_READING_TEXT[name]}" for name in section.readings_shown)
    yield comparison_table(section)
    yield "= the paper's number to 0.01, or within its bound; ≠ not."
    if not section.recordings:
        yield f"Not computed: {NEED_RECORDINGS}."
    columns: Columns[ReadingRow] = {
        "model": lambda r: r.model,
        "averaging": lambda r: r.reading.averaging,
        "unconditioned": lambda r: r.reading.unconditioned,
        "classes": lambda r: r.reading.classes,
        "large set": lambda r: r.reading.large,
        "large": lambda r: number(r.scores.rmsd["large"]),
        "small": lambda r: number(r.scores.rmsd["small"]),
        "all": lambda r: number(r.scores.rmsd["all"]),
    }
    ours = section.sources[0]
    # Each unconditioned stretch with its own set of large reductions.
    own = {"reference": "text", "conditioning": "released"}
    rows = [r for r in section.readings if r.source == ours and r.reading.large == own[r.reading.unconditioned]]
    yield f"### Other readings of the averages ({ours})"
    yield f"All sources and readings are in `srs_rmsd.csv`.\n\n{markdown(*filled(columns, rows))}"


def _force_pca(rows: Sequence[ForcePcaRow]) -> Iterator[str]:
    def told(say: Callable[[ForcePca], str]) -> Callable[[ForcePcaRow], str]:
        return lambda row: NOTHING if isinstance(row.fit, Missing) else say(row.fit)

    columns: Columns[ForcePcaRow] = {
        "fibre": lambda row: row.fibre,
        "of": lambda row: row.of,
        "pCa50 ± SE": told(lambda fit: with_error(fit.pca50, fit.pca50_se)),
        "Hill coefficient ± SE": told(lambda fit: with_error(fit.n_hill, fit.n_hill_se, ".2f")),
        "passive (F0)": told(lambda fit: number(fit.passive_f0)),
        "maximal (F0)": told(lambda fit: number(fit.maximal_f0)),
        "RMSD (F0)": told(lambda fit: number(fit.rmsd_f0)),
        "pCa levels": told(lambda fit: str(fit.points)),
    }
    if rows:
        yield f"## Isometric force against pCa\n\n{markdown(*filled(columns, rows))}"


def _k_tr(rows: Sequence[RedevelopmentRow]) -> Iterator[str]:
    columns: Columns[RedevelopmentRow] = {
        "fibre": lambda row: row.fibre,
        "trial": lambda row: row.trial,
        "pCa": lambda row: number(row.pca, "g"),
        "of": lambda row: row.of,
        "k_tr ± SE, 1/s": lambda row: with_error(row.k_per_s, row.se_per_s, ".2f"),
    }
    if rows:
        yield f"## Rate of force redevelopment\n\n{_table(columns, rows)}"


def _enhancement(found: Sections) -> Iterator[str]:
    def told(say: Callable[[Enhancement], str]) -> Callable[[EnhancementRow], str]:
        return lambda row: NOTHING if isinstance(row.found, Missing) else say(row.found)

    columns: Columns[EnhancementRow] = {
        "stretched": lambda row: row.stretched,
        "isometric": lambda row: row.isometric,
        "stretch (% L0)": lambda row: number(row.stretch_l0, ".1f", 100.0),
        "of": lambda row: row.of,
        "force (F0)": told(lambda e: number(e.stretched_f0)),
        "isometric (F0)": told(lambda e: number(e.isometric_f0)),
        "enhancement ± SE (F0)": told(lambda e: with_error(e.enhancement_f0, e.enhancement_se_f0)),
        "% ± SE": told(lambda e: with_error(e.relative, e.relative_se, ".1f", 100.0)),
    }
    if found.residual_force_enhancement:
        yield f"## Residual force enhancement, {found.enhancement_after_s:g} s after the stretch"
        yield (
            "Each beside one isometric trial. The standard error is that of the noise; what a muscle does differently "
            "from one trial to the next is not in it."
        )
        yield _table(columns, found.residual_force_enhancement)


def _percent(held: Spread | None) -> str:
    if held is None:
        return NOTHING
    return number(held.mean, ".2f", 100.0) + ("" if held.sd is None else f" ± {100.0 * held.sd:.2f}")
