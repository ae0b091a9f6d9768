"""Figures of a diagnosis, as vector graphics with the captions that belong to them."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

from xb_muscle_ros.diagnose.report.figures.before_after import draw_before_after
from xb_muscle_ros.diagnose.report.figures.common import Figure
from xb_muscle_ros.diagnose.report.figures.contributions import draw_contributions
from xb_muscle_ros.diagnose.report.figures.fibres import draw_fibres
from xb_muscle_ros.diagnose.report.figures.laws import draw_laws
from xb_muscle_ros.diagnose.report.figures.probabilities import draw_probabilities
from xb_muscle_ros.diagnose.report.figures.residual_map import draw_map
from xb_muscle_ros.diagnose.report.traces import TrialTraces
from xb_muscle_ros.diagnose.result import Diagnosis

FIGURES: Mapping[str, Callable[[Diagnosis, Sequence[TrialTraces]], Figure | None]] = MappingProxyType(
    {
        "before_after": draw_before_after,
        "probabilities": lambda d, _: draw_probabilities(d),
        "contributions": draw_contributions,
        "fibres": lambda d, _: draw_fibres(d),
        "map": lambda d, _: draw_map(d),
        "laws": lambda d, _: draw_laws(d),
    }
)
"""By name, in the order of the page; a figure is None where a diagnosis has nothing to show in it."""
