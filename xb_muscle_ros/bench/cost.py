"""Cost against accuracy of the solution methods, after the paper's study (van der Zee et al. 2026, Fig 8).

One condition (AMP 3.83 % L0, RT 1 ms, pCa 6.1, 2.34 s, steps of 1e-4 s). The strain grid is varied in two ways: more
bins over ±15 power strokes, and more range at the bin width of 100 bins over ±15. Force errors are root mean squares
against characteristics with 10,000 bins over ±15.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from xb_muscle_ros.bench.measure import Figure, Setting, timed
from xb_muscle_ros.bench.papers_trial import PapersTrial
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.registry import compose
from xb_muscle_ros.plotting.style import DATA, MODEL, SECOND, THIRD, figure, save
from xb_muscle_ros.progress import Progress

# Right-hand sides in a step: the moments' stepper and the grids' both take two.
_EVALUATIONS = 2
REFERENCE_BINS = 10000
BINS = (25, 50, 100, 200, 400, 1000, 2000)
RANGES = (4.0, 7.0, 15.0, 30.0)
_WIDTH = 30.0 / 99.0
LOOKS = {
    "fixed_grid": ("linear remap", "s", DATA),
    "fixed_grid_conservative": ("conservative remap", "^", THIRD),
    "characteristics": ("characteristics", "o", MODEL),
    "gaussian": ("Gaussian", "D", SECOND),
}
# Read off the paper's text, MATLAB: one evaluation in µs, the trial in s.
PAPER = {"gaussian": (17.0, 0.4), "characteristics": (25.0, 0.6)}


@dataclass(frozen=True)
class Point:
    """One method on one grid.

    Attributes:
        method: registry name.
        bins, strain_range: of the grid; 0 for the Gaussian form.
        series: ``bins`` (range fixed), ``range`` (bin width fixed) or ``variable`` (variable steps).
        evaluations: right-hand sides evaluated.
        seconds: median time of the trial.
        error_f0: root-mean-square force error, F0.
    """

    method: str
    bins: int
    strain_range: float
    series: str
    evaluations: int
    seconds: float
    error_f0: float


def _fibre(fibre: Fibre, method: str, bins: int, strain_range: float) -> Fibre:
    values = dict(fibre.values)
    for row in compose(fibre.model, method).parameters:
        if row.name not in values and row.default is not None:
            values[row.name] = row.default
    if "bins" in values:
        values |= {"bins": float(bins), "strain_range": strain_range}
    return replace(fibre, method=method, values=values)


class Condition:
    """The paper's trial, and the reference that errors are taken against."""

    def __init__(self, fibre: Fibre, repeats: int = 5, reference_bins: int = REFERENCE_BINS) -> None:
        """Compute the reference (a few seconds)."""
        self._fibre, self._repeats = fibre, repeats
        reference = PapersTrial(Muscle(_fibre(fibre, "characteristics", reference_bins, 15.0)))
        self._reference = reference.force_f0(reference.fixed())

    def point(self, method: str, bins: int, strain_range: float, series: str, tolerance: float | None = None) -> Point:
        """Measure a method with steps of 1e-4 s, or with variable steps of a tolerance."""
        trial = PapersTrial(Muscle(_fibre(self._fibre, method, bins, strain_range)))
        work = trial.fixed if tolerance is None else functools.partial(trial.variable, tolerance)
        found = work()
        error = float(np.sqrt(np.mean((trial.force_f0(found) - self._reference) ** 2)))
        repeats = self._repeats * (1 if tolerance is None else 4)
        return Point(
            method, bins, strain_range, series, _EVALUATIONS * found[1], timed("", work, repeats, "s", "").value, error
        )

    def points(self) -> list[Point]:
        """All points, cheapest method first."""
        grids = [(bins, 15.0, "bins") for bins in BINS]
        grids += [(1 + round(2.0 * reach / _WIDTH), reach, "range") for reach in RANGES if reach != 15.0]
        methods = ("characteristics", "fixed_grid", "fixed_grid_conservative")
        steps = [functools.partial(self.point, "gaussian", 0, 0.0, "bins")]
        steps += [functools.partial(self.point, "gaussian", 0, 0.0, "variable", each) for each in (1e-4, 1e-6)]
        steps += [functools.partial(self.point, method, *grid) for method in methods for grid in grids]
        made = []
        with Progress(len(steps), "cost") as progress:
            for step in steps:
                made.append(step())
                progress.update()
        return made


def study(setting: Setting) -> list[Figure]:
    """Measure all points and draw them."""
    points = Condition(setting.fibre).points()
    draw(points, setting.drawing("cost"))
    return figures(points)


def figures(points: list[Point]) -> list[Figure]:
    """Points as entries of ``bench.json``."""
    made = []
    for p in points:
        grid = f", {p.bins} bins over ±{p.strain_range:g}" if p.bins else ""
        steps = ", variable steps" if p.series == "variable" else ""
        name = f"cost study, {p.method}{grid}{steps}"
        paper = ""
        if p.method in PAPER and (p.bins in (0, 100)) and p.strain_range in (0.0, 15.0) and not steps:
            paper = f"; paper: {1e3 * PAPER[p.method][1]:.0f} ms"
        made.append(Figure(name, 1e3 * p.seconds, "ms", f"{p.evaluations} evaluations{paper}"))
        what = f"RMS against characteristics, {REFERENCE_BINS} bins"
        made.append(Figure(f"{name}, force error", 100.0 * p.error_f0, "% F0", what))
    return made


def draw(points: list[Point], path: Path) -> None:
    """Time and error against the number of bins, and error against time, for both ways to vary the grid."""
    from matplotlib.ticker import NullFormatter, NullLocator

    with figure(178.0, 115.0) as made:
        axes = made.subplots(2, 3)
        for row, (series, title) in enumerate((("bins", "range fixed at ±15"), ("range", "bin width fixed"))):
            time_axes, error_axes, both = axes[row]
            for method, (label, marker, colour) in LOOKS.items():
                chosen = [
                    p
                    for p in points
                    if p.method == method and (p.series == series or (series == "range" and p.bins == 100))
                ]
                if not chosen or method == "gaussian":
                    continue
                chosen.sort(key=lambda p: p.bins)
                bins = [p.bins for p in chosen]
                look = {"marker": marker, "color": colour, "markersize": 4, "label": label}
                time_axes.loglog(bins, [1e3 * p.seconds for p in chosen], **look)
                error_axes.loglog(bins, [100.0 * p.error_f0 for p in chosen], **look)
                both.loglog([1e3 * p.seconds for p in chosen], [100.0 * p.error_f0 for p in chosen], **look)
            for p in points:
                if p.method == "gaussian":
                    label, marker, colour = LOOKS["gaussian"]
                    variable = p.series == "variable"
                    if not variable:
                        time_axes.axhline(1e3 * p.seconds, color=colour, linestyle=":", linewidth=1)
                        error_axes.axhline(100.0 * p.error_f0, color=colour, linestyle=":", linewidth=1)
                    # Of the points with variable steps one alone stands in the legend.
                    named = "" if variable and p is not points[1] else label + ", variable steps" * variable
                    both.loglog(
                        1e3 * p.seconds, 100.0 * p.error_f0, marker, color=colour, markersize=5, label=named or None,
                        markerfacecolor="none" if variable else colour,
                    )  # fmt: skip
            time_axes.set_ylabel(f"{title}\nTime for 2.34 s (ms)")
            error_axes.set_ylabel("Force error (% F$_0$)")
            both.set_ylabel("Force error (% F$_0$)")
            for one in (time_axes, error_axes):
                ticks = sorted({p.bins for p in points if p.bins and (p.series == series or p.bins == 100)})
                one.set_xticks(ticks, [str(t) for t in ticks], rotation=45)
                one.xaxis.set_minor_locator(NullLocator())
                one.set_xlabel("Bins")
            for one in axes[row]:
                one.yaxis.set_minor_formatter(NullFormatter())
            both.set_xlabel("Time for 2.34 s (ms)")
        handles, labels = axes[0][2].get_legend_handles_labels()
        made.legend(handles, labels, loc="outside upper center", ncols=5, frameon=False)
        save(made, path)
