"""Tables and figures of results: pandas and Matplotlib, loaded when they are asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from xb_muscle_ros.errors import UserError, suggest

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


def dataframe(rows: Iterable[Mapping[str, Any]] | Mapping[str, Any]) -> pd.DataFrame:
    """Rows by column name, or columns by name, as a table.

    Raises:
        UserError: pandas is not there.
    """
    try:
        import pandas as pd
    except ImportError as error:
        raise UserError(f"to_dataframe needs pandas ({error}); pip install pandas") from error
    return pd.DataFrame(rows if isinstance(rows, Mapping) else list(rows))


def flat(row: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """A row whose mappings within become columns ``outer.inner``."""
    made: dict[str, Any] = {}
    for key, value in row.items():
        made |= flat(value, f"{prefix}{key}.") if isinstance(value, Mapping) else {f"{prefix}{key}": value}
    return made


def drawn(draw: Callable[[], object], which: str | None = None) -> Figure:
    """One of the figures that a function draws into files, in place of the files.

    Args:
        draw: draws.
        which: name of the figure's file, without suffix; None: the first.

    Raises:
        UserError: there is no figure, or none of this name.
    """
    from xb_muscle_ros.plotting.style import kept

    with kept() as figures:
        draw()
    named: dict[str, Figure] = {made.get_label(): made for made in figures}
    if not named:
        raise UserError("this result has nothing to draw")
    if which is None:
        return next(iter(named.values()))
    if which not in named:
        raise UserError(f"figure '{which}' is not among those of this result{suggest(which, named)}")
    return named[which]
