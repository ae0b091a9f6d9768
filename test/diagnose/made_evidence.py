"""Made evidence for decisions: no simulation."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

from xb_muscle_ros.diagnose.crossval import HeldOut
from xb_muscle_ros.diagnose.mismatch import Bound
from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.diagnose.refit import Fit
from xb_muscle_ros.diagnose.search import Search
from xb_muscle_ros.diagnose.study import Explanation
from xb_muscle_ros.diagnose.verdict import Evidence

TRIALS = [f"t{i}" for i in range(7)]
NOISE = 0.0007


def fit(rmsd: float, *names: Name) -> Fit:
    explanation = Explanation()
    for name in names:
        explanation = explanation.plus(name)
    return Fit(explanation, {}, 4e7 * rmsd**2, rmsd, 1)


def scores(rmsd: float) -> HeldOut:
    return HeldOut(dict.fromkeys(TRIALS, rmsd**2), dict.fromkeys(TRIALS, 1000))


def evidence(final: Fit, *others: Fit, base: float = 0.006, **changes: Any) -> Evidence:
    """Evidence in which everything speaks for the final explanation, but for the changes."""
    bottom = fit(base)
    fits = {f.explanation.label: f for f in (bottom, *others, final)}
    study = SimpleNamespace(trials=[SimpleNamespace(name=t) for t in TRIALS])
    search = Search(study, bottom, final, (), None, fits)  # type: ignore[arg-type]
    made = Evidence(
        search=search,
        start_rmsd_f0=0.05,
        noise_f0=NOISE,
        detected=True,
        p_value=0.004,
        heldout={"base": scores(1.3 * base), final.explanation.label: scores(1.3 * final.rmsd_f0)},
        bound=Bound(1.3 * base, 1.3 * final.rmsd_f0, 1.4 * final.rmsd_f0),
        interval=(0.01, 0.03),
        at_bound=False,
        cleaned=0.95,
    )
    return replace(made, **changes)
