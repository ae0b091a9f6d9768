"""Write config/fibers/*.yaml from the authors' released parameter sets (parameters.json).

Usage: make_fibre_files.py PARAMETERS_JSON OUT_FOLDER; then fit_missing_sets.py adds the sets that nobody released.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from xb_muscle_ros.models.registry import compose

# Name of a released set -> name of our parameter set.
SETS = {
    "3state_coop": "3state_coop",
    "3state_coop_v3": "3state_coop_v3",
    "2state_xb": "2state",
    "4state_coop": "4state_coop",
    "hill_se": "hill_se",
}
# Released names that differ from the table's.
RENAMED = {"smoothing": "K"}
# What stands in the authors' programs and not in a set.
AS_RUN = {"steepness": 3.0}
# The sets whose golden output was made with the heads' stiffness smoothed in the velocity constraint too.
SMOOTH_STIFFNESS = ("3state_coop_v3", "4state_coop")
# The released sets keep these four in one list, "e".
SHAPE = ("e1", "e2", "e3", "e4")
SOURCE = (
    "van der Zee et al. 2026, released parameter sets (github timvanderzee/biophysical-muscle-model), "
    "fitted to Horslen et al. 2023"
)
HEAD = """# Fibre {fibre}: permeabilised rat soleus, 22 °C. A ROS parameter file; offline tools read it as well.
# Units, meaning and range of every parameter: xb_muscle parameters.
# smoothing 100: the sets were fitted with smooth functions in place of exact ones (see docs/model.md).
"""


def block(name: str, released: dict[str, Any]) -> list[str]:
    """Lines of one parameter set."""
    lines = [f"      {name}:"]
    for row in compose(name).parameters:
        if row.name == "smooth_stiffness":
            value = 1.0 if name in SMOOTH_STIFFNESS else 0.0
        elif row.name in AS_RUN:
            value = AS_RUN[row.name]
        elif row.name in SHAPE:
            value = float(released["e"][SHAPE.index(row.name)])
        elif RENAMED.get(row.name, row.name) in released:
            value = float(released[RENAMED.get(row.name, row.name)])
        else:
            continue
        lines.append(f"        {row.name}: {value!r}")
    return lines


def main(source: Path, folder: Path) -> None:
    """Write one file per fibre."""
    released = json.loads(source.read_text(encoding="utf-8"))
    folder.mkdir(parents=True, exist_ok=True)
    for fibre in sorted(released["3state_coop"]):
        lines = ["/**:", "  ros__parameters:", f'    fibre: "{fibre}"', '    model: "3state_coop"']
        lines += ['    method: "gaussian"', f'    source: "{SOURCE}"', "    constants:"]
        lines += ["      reference_length_m: 1.0", "      f0_n: 1.0", "    models:"]
        for theirs, ours in SETS.items():
            lines += block(ours, released[theirs][fibre])
        (folder / f"{fibre}.yaml").write_text(HEAD.format(fibre=fibre) + "\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
