"""The constants of `diagnose/inference/calibration.py` from an open benchmark of composites.

RESULTS are those of `xb_muscle prove run`, whose components hold log-odds of averaging over sets and contributions;
KEY is the benchmark's. By maximum likelihood: a component is right where its mechanism is there, or of a family of
several where any of them is. Never for a sealed benchmark: what is fitted to it is not proved by it.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from xb_muscle_ros.diagnose.inference import calibration
from xb_muscle_ros.diagnose.inference.calibration import Constants, calibrated
from xb_muscle_ros.prove.calibration import Stated, error


class Row(NamedTuple):
    """A component of a case: its log-odds and contribution (F0), and whether it is there."""

    log_odds: float
    contribution_f0: float
    there: bool


def rows_of(truth: dict[str, Any], found: dict[str, Any]) -> list[Row]:
    """All components of a case that are mechanisms."""
    names = {effect["label"] for effect in truth["effects"]}
    families = {effect["family"] for effect in truth["effects"]}
    return [
        Row(
            c["log_odds"],
            c["contribution_f0"],
            c["name"] in names if len(c["members"]) == 1 else c["family"] in families,
        )
        for c in found.get("components", [])
        if c["kind"] == "mechanism"
    ]


def stated(cases: list[list[Row]], constants: Constants) -> list[list[Stated]]:
    """What the constants make of all components."""
    return [[Stated(calibrated(r.log_odds, r.contribution_f0, constants), r.there) for r in rows] for rows in cases]


def loss(cases: list[list[Row]], constants: Constants) -> float:
    """Negative log-likelihood."""
    said = [s for of_case in stated(cases, constants) for s in of_case]
    return -float(sum(np.log(s.probability if s.right else 1.0 - s.probability) for s in said))


def main(given: argparse.Namespace) -> None:
    """Fit, and compare with the constants in use."""
    results = json.loads((given.results / "results.json").read_text(encoding="utf-8"))["cases"]
    truths = json.loads(given.key.read_text(encoding="utf-8"))["cases"]
    cases = [rows_of(t, results[t["case"]]) for t in truths if t["case"] in results and t["case"] not in given.without]
    used = calibration.CONSTANTS

    def objective(x: npt.NDArray[np.float64]) -> float:
        return loss(cases, Constants(*x.tolist()))

    found = minimize(objective, np.array(used), method="Nelder-Mead")
    for title, constants in (("in use", used), ("fitted", Constants(*found.x.tolist()))):
        print(
            f"{title}: offset {constants.offset:.2f}, slope {constants.slope:.2f}, size {constants.size:.2f}; negative "
            f"log-likelihood {loss(cases, constants):.1f}, expected calibration error "
            f"{error(stated(cases, constants)):.3f} ({len(cases)} cases)"
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=Path, help="folder of prove run")
    parser.add_argument("key", type=Path)
    parser.add_argument("--without", nargs="*", default=[], metavar="CASE", help="cases that are left out")
    main(parser.parse_args())
