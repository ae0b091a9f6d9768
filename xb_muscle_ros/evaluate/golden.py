"""The authors' released output beside ours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from xb_muscle_ros.evaluate.paper import Source
from xb_muscle_ros.evaluate.sets import ModelSet
from xb_muscle_ros.evaluate.srs_table import SrsTable

# Name of a golden table -> parameter set of the fibre files.
SETS = {
    "3state_coop": "3state_coop",
    "3state_coop_v3": "3state_coop_v3",
    "2state_xb": "2state",
    "3state_coop_discretised": "3state_coop",
    "4state_coop": "4state_coop",
    "hill_se": "hill_se",
}
# Tables that were not made with the Gaussian form.
METHODS = {"3state_coop_discretised": "characteristics", "4state_coop": "characteristics"}
OURS, GOLDEN = "ours", "released output"
"""Names of the two sources."""


def golden_sources(
    golden: Mapping[str, SrsTable], models: Sequence[ModelSet], tables: Mapping[str, SrsTable]
) -> list[Source]:
    """The authors' output for the sets evaluated, and ours on the same fibres where theirs are fewer."""
    theirs: dict[str, SrsTable] = {}
    for each in models:
        method = next(iter(each.fibres.values())).method
        named = [name for name, of in SETS.items() if of == each.name and name in golden]
        # The table made with the same method where there are several.
        named.sort(key=lambda name: METHODS.get(name, "gaussian") != method)
        if named:
            theirs[each.name] = golden[named[0]].only(list(each.fibres))
    ours = {name: tables[name].only(list(theirs[name].fibres)) for name in theirs}
    fewer = any(len(ours[name].fibres) < len(tables[name].fibres) for name in theirs)
    count = max((len(table.fibres) for table in theirs.values()), default=0)
    sources = [Source(f"{OURS}, {count} fibres", ours, {})] if fewer else []
    return [*sources, Source(GOLDEN, theirs, {})] if theirs else []
