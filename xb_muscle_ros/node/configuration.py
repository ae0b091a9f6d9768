"""From what a user gave to a fibre: a fibre file, ROS parameters, or parameters on top of a file."""

from __future__ import annotations

from collections.abc import Mapping

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre, fibre_from_parameters, load_fibre

WHERE = "parameters"


def configure(fiber_file: str, given: Mapping[str, object]) -> tuple[Fibre, dict[str, object]]:
    """Fibre from a file with parameters on top, or from parameters alone.

    Args:
        fiber_file: path or packaged name; empty for none.
        given: by flat ROS name; empty text counts as not given.

    Returns:
        The fibre, and every parameter of it by flat ROS name, all its sets complete with their defaults.

    Raises:
        UserError: nothing to build from, or something wrong with it; unknown names come with a suggestion.
    """
    wanted = {name: value for name, value in given.items() if value != ""}
    where = WHERE
    if fiber_file:
        file = load_fibre(fiber_file)
        where = f"fibre file {file.path} with parameters on top" if wanted else f"fibre file {file.path}"
        base: dict[str, object] = {}
        for name in file.available_models:
            base.update(flat(load_fibre(fiber_file, model=name)))
        wanted = {**base, "model": file.model, **wanted}
    elif not any(name.startswith("models.") for name in wanted):
        raise UserError(
            "no fibre is given; add --ros-args --params-file with a fibre file such as config/fibers/18Dec2017a.yaml, "
            "or -p fiber_file:=18Dec2017a"
        )
    fibre = fibre_from_parameters(wanted, where)
    values: dict[str, object] = {}
    for name in fibre.available_models:
        values.update(flat(fibre_from_parameters(wanted, where, model=name)))
    return fibre, {**values, **flat(fibre)}


def flat(fibre: Fibre) -> dict[str, object]:
    """A fibre and the set in use by flat ROS name, as `fibre_from_parameters` takes them."""
    return {
        "fibre": fibre.name,
        "model": fibre.model,
        "method": fibre.method,
        "source": fibre.source,
        f"sources.{fibre.model}": fibre.source,
        "constants.reference_length_m": fibre.reference_length_m,
        "constants.f0_n": fibre.f0_n,
        **{f"models.{fibre.model}.{name}": value for name, value in fibre.values.items()},
    }
