"""Figures of a diagnosis, as vector graphics with the captions that belong to them."""

from xb_muscle_ros.diagnose.report.figures.before_after import draw_before_after
from xb_muscle_ros.diagnose.report.figures.contributions import draw_contributions
from xb_muscle_ros.diagnose.report.figures.fibres import draw_fibres
from xb_muscle_ros.diagnose.report.figures.laws import draw_laws
from xb_muscle_ros.diagnose.report.figures.probabilities import draw_probabilities
from xb_muscle_ros.diagnose.report.figures.residual_map import draw_map

__all__ = [
    "draw_before_after", "draw_contributions", "draw_fibres", "draw_laws", "draw_map", "draw_probabilities",
]  # fmt: skip
