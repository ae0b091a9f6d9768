"""Every mechanism and every pair of them on top of a model, by the engine of `xb_muscle diagnose` without its search.

All fibres are fitted together as a diagnosis fits them: ordinary measurement error in every model, one distribution of
each effect over fibres, the evidence of all fibres. Each pair starts from both singles. The pairs with the most
evidence, and all singles, then predict conditions that are left out of their fits. Finished fits are kept in --journal.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from xb_muscle_ros.cli.common import add_work, work_options_of
from xb_muscle_ros.diagnose.effort import QUICK, Effort
from xb_muscle_ros.diagnose.error_sds import error_sds_of
from xb_muscle_ros.diagnose.inference.heldout import HeldOut
from xb_muscle_ros.diagnose.intake import read_fibres
from xb_muscle_ros.diagnose.names import MEASUREMENT
from xb_muscle_ros.diagnose.search.explore import Explorer
from xb_muscle_ros.diagnose.search.system import Names, ordered
from xb_muscle_ros.diagnose.searching import fit_base
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import write_text
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.tables import NOTHING, markdown, number


def singles(explorer: Explorer) -> list[Names]:
    """Fit each mechanism by itself; those that have a solution in every fibre, with the most evidence first."""
    promised = {n: p for n, p in explorer.promises(()).items() if n not in MEASUREMENT}
    found = explorer.fit([((n,), explorer.starts(p)) for n, p in promised.items()], "singles")
    return sorted(found, key=explorer.evidence, reverse=True)


def pairs(explorer: Explorer, alone: Sequence[Names]) -> list[Names]:
    """Fit each pair from the fits of both its mechanisms."""
    starts: dict[Names, list[list[list[Mapping[str, float]]]]] = {}
    for single in alone:
        for name, promised in explorer.promises(single).items():
            if (name,) in alone:
                starts.setdefault(ordered((*single, name)), []).append(explorer.starts(promised))
    found = []
    for k, (names, each) in enumerate(starts.items(), 1):
        both = [[s for own in fibre for s in own] for fibre in zip(*each, strict=True)]
        found += explorer.fit([(names, both)], f"pair {k} of {len(starts)}")
    return found


def table(explorer: Explorer, heldout: HeldOut, sets: Sequence[Names]) -> str:
    """Markdown: evidence, and RMSD of fit and of left-out conditions by set, % F0; the most evidence first."""
    fibres = [s.fibre.name for s in explorer.systems]
    head = [
        f"on top of `{explorer.systems[0].fibre.model}`",
        "log evidence",
        "fitted",
        *fibres,
        "all left out",
        "of base",
    ]
    rows = []
    base = heldout.rmsd(())
    for names in sorted(sets, key=explorer.evidence, reverse=True):
        fitted = float(np.sqrt(np.mean([f.mean_square_f0 for f in explorer.fits[names]])))
        cells = [heldout.rmsd(names, i) for i in range(len(fibres))] + [heldout.rmsd(names)]
        held = [number(c, ".2f", 100.0) for c in cells]
        share = NOTHING if cells[-1] is None or not base else f"{cells[-1] / base:.2f}"
        gained = explorer.evidence(names) - explorer.evidence(())
        title = " + ".join(f"`{n}`" for n in names) or "nothing"
        rows.append([title, f"{gained:+.1f}", f"{100.0 * fitted:.2f}", *held, share])
    return markdown(head, rows) + "\n"


def main(given: argparse.Namespace) -> None:
    """Fit all sets and write the table."""
    studies = read_fibres(given.bags, [load_fibre(name, given.model) for name in given.fiber])
    effort = QUICK if given.quick else Effort()
    study = fit_base(
        studies, effort, 1, work_options_of(given, journal=given.journal), {}, error_sds_of(given.nuisance)
    )
    explorer = study.explorer
    alone = singles(explorer)
    both = pairs(explorer, alone)
    heldout = HeldOut(explorer, study.recorded)
    best = sorted(both, key=explorer.evidence, reverse=True)[: given.predicted]
    heldout.predict([(), *alone, *best])
    write_text(given.out, table(explorer, heldout, [(), *alone, *both]))
    print(given.out.read_text(encoding="utf-8"))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bags", nargs="+", type=Path, help="bags or folders of bags")
    parser.add_argument("--fiber", nargs="+", required=True, help="fibres, or fibre files")
    parser.add_argument("--model", default="3state_coop", help="model that the mechanisms come on top of")
    parser.add_argument("--nuisance", nargs="+", default=[], metavar="FAULT=SD", help="as of xb_muscle diagnose")
    parser.add_argument("--predicted", type=int, default=12, help="so many pairs predict left-out conditions")
    parser.add_argument("--quick", action="store_true", help="look less hard")
    parser.add_argument("--journal", type=Path, help="file that keeps finished fits")
    parser.add_argument("--out", type=Path, default=Path("pairs.md"), help="table")
    add_work(parser)
    try:
        main(parser.parse_args())
    except UserError as error:
        sys.exit(f"compare_pairs: {error}")
