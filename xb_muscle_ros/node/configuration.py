"""From what a user gave to fibres: fibre files, ROS parameters, or parameters on top of a file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.models.fibre_file import Fibre, fibre_from_parameters, find_fibre_file, load_fibre

WHERE = "parameters"

# First parts of parameter names that no fibre can have for its name.
GROUPS = ("models", "constants", "sources")
_OF_EACH = (*GROUPS, "source")


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
        base = _whole_file(fiber_file)
        path = find_fibre_file(fiber_file)
        where = f"fibre file {path} with parameters on top" if wanted else f"fibre file {path}"
        wanted = {**base, **wanted}
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


def configure_many(
    names: Sequence[str], files: Sequence[str], given: Mapping[str, object]
) -> dict[str, tuple[Fibre, dict[str, object]]]:
    """Fibres of one model and method, each from its file, with common parameters on top and its own on top of those.

    Args:
        names: of the fibres, as many as files; empty: those in the files.
        files: paths or packaged names.
        given: by flat ROS name: ``model``, ``constants.f0_n`` and the like count for all fibres,
            ``<fibre>.constants.f0_n`` for one; empty text counts as not given.

    Returns:
        By name and in order: the fibre, and every parameter of it (of the set in use) by flat ROS name.

    Raises:
        UserError: names and files do not fit, a name twice, something wrong with a file or a parameter.
    """
    if names and len(names) != len(files):
        raise UserError(
            f"parameter 'fibers' has {len(names)} names, 'fiber_files' has {len(files)} files; give one file for each, "
            "or one for all in 'fiber_file'"
        )
    whole = {file: _whole_file(file) for file in dict.fromkeys(files)}
    names = names or [str(whole[file]["fibre"]) for file in files]
    _check_names(names)
    common, own = _split(names, {name: value for name, value in given.items() if value != ""})
    made: dict[str, tuple[Fibre, dict[str, object]]] = {}
    for name, file in zip(names, files, strict=True):
        wanted = {**whole[file], **common, **own[name], "fibre": name}
        fibre = fibre_from_parameters(wanted, f"fibre {name} (file {file} and parameters)")
        made[name] = fibre, flat(fibre)
    return made


def _check_names(names: Sequence[str]) -> None:
    for name in names:
        if not name or "." in name or "/" in name or name in GROUPS:
            raise UserError(
                f"fibre name '{name}' cannot be used; it must not be empty, contain . or /, or be {' or '.join(GROUPS)}"
            )
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if twice:
        raise UserError(f"fibre '{twice[0]}' occurs {names.count(twice[0])} times; give each a name with 'fibers'")


def _split(names: Iterable[str], given: Mapping[str, object]) -> tuple[dict[str, object], dict[str, dict[str, object]]]:
    """Parameters of all fibres, and those of each."""
    common: dict[str, object] = {}
    own: dict[str, dict[str, object]] = {name: {} for name in names}
    for name, value in given.items():
        head, _, rest = name.partition(".")
        if head in own and rest:
            if rest.partition(".")[0] not in _OF_EACH:
                raise UserError(
                    f"parameter '{name}' is not known; a fibre of many has {', '.join(_OF_EACH)} of its own"
                )
            own[head][rest] = value
        elif rest and head not in GROUPS:
            raise UserError(f"parameter '{name}' is not known: there is no fibre '{head}'{suggest(head, own)}")
        elif name == "fibre":
            raise UserError(f"parameter 'fibre' is '{value}', but there are many fibres; give their names in 'fibers'")
        else:
            common[name] = value
    return common, own


def _whole_file(fiber_file: str) -> dict[str, object]:
    """Every parameter of a file by flat ROS name, all its sets complete with their defaults."""
    file = load_fibre(fiber_file)
    base: dict[str, object] = {}
    for name in file.available_models:
        base.update(flat(load_fibre(fiber_file, model=name)))
    return {**base, "model": file.model}


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
