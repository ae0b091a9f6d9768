"""From what a user gave to fibres: fibre files, ROS parameters, or parameters on top of a file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.models.fibre_file import Fibre, fibre_from_parameters, find_fibre_file, load_fibre
from xb_muscle_ros.node.foreign_keys import GROUPS, foreign_keys

WHERE = "parameters"

_OF_EACH = (*GROUPS, "source")


class Configured(NamedTuple):
    """What parameters amount to.

    Attributes:
        fibre: built.
        values: every parameter of it by flat ROS name.
        of_file: the same as the fibre's file alone has them; empty without a file.
    """

    fibre: Fibre
    values: dict[str, object]
    of_file: Mapping[str, object]


def configure(fiber_file: str, given: Mapping[str, object], node: str = "muscle_node") -> Configured:
    """Fibre from a file with parameters on top, or from parameters alone.

    Args:
        fiber_file: path or packaged name; empty for none.
        given: by flat ROS name; empty text counts as not given.
        node: full name, for the message.

    Returns:
        The fibre; its values are those of all its sets, complete with their defaults.

    Raises:
        UserError: nothing to build from, or something wrong with it; unknown names come with a suggestion.
    """
    wanted = {name: value for name, value in given.items() if value != ""}
    where, base = WHERE, {}
    if fiber_file:
        base = _whole_file(fiber_file)
        path = find_fibre_file(fiber_file)
        where = f"fibre file {path} with parameters on top" if wanted else f"fibre file {path}"
        wanted = {**base, **wanted}
    elif not any(name.startswith("models.") for name in wanted):
        raise UserError(
            f"no fibre is given to {node}; add --ros-args --params-file with a fibre file such as "
            "config/fibers/18Dec2017a.yaml, or -p fiber_file:=18Dec2017a; in a parameter file only what stands below "
            f"the key '{node}' or '/**' is for this node"
        )
    fibre = fibre_from_parameters(wanted, where)
    values: dict[str, object] = {}
    for name in fibre.available_models:
        values.update(flat(fibre_from_parameters(wanted, where, model=name)))
    return Configured(fibre, {**values, **flat(fibre)}, _of_file_alone(base, fibre))


def configure_many(
    names: Sequence[str],
    files: Sequence[str],
    given: Mapping[str, object],
    ignore: Callable[[Sequence[str]], None] = lambda names: None,
    earlier: Iterable[str] = (),
) -> dict[str, Configured]:
    """Fibres of one model and method, each from its file, with common parameters on top and its own on top of those.

    Args:
        names: of the fibres, as many as files; empty: those in the files.
        files: paths or packaged names.
        given: by flat ROS name: ``model``, ``constants.f0_n`` and the like count for all fibres,
            ``<fibre>.constants.f0_n`` for one; empty text counts as not given.
        ignore: told the names of parameters that are another node's, or of a fibre that is gone, where there are any.
        earlier: fibres that the node had before.

    Returns:
        By name and in order; values are those of the set in use.

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
    # Those without a dot were looked at when they came.
    gone = {*earlier} - {*names}
    dotted = [name for name in given if "." in name]
    foreign = [name for name in dotted if name.partition(".")[0] in gone]
    foreign += foreign_keys([name for name in dotted if name not in foreign], (), names)
    if foreign:
        ignore(foreign)
    wanted_ones = {name: value for name, value in given.items() if value != "" and name not in foreign}
    common, own = _split(names, wanted_ones)
    made: dict[str, Configured] = {}
    for name, file in zip(names, files, strict=True):
        wanted = {**whole[file], **common, **own[name], "fibre": name}
        fibre = fibre_from_parameters(wanted, f"fibre {name} (file {file} and parameters)")
        made[name] = Configured(fibre, flat(fibre), _of_file_alone(whole[file], fibre))
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
    return {**base, "model": file.model, "source": file.source}


def _of_file_alone(base: Mapping[str, object], fibre: Fibre) -> Mapping[str, object]:
    """Parameters of a file (see `_whole_file`) with those of the fibre's set, which it may only have a base of."""
    if not base:
        return base
    try:
        alone = flat(fibre_from_parameters(base, WHERE, fibre.model, fibre.method))
        return {**base, **alone, **{name: base[name] for name in ("model", "method")}}
    except UserError:
        # The set in use came with the parameters.
        return base


def declared(values: Mapping[str, Mapping[str, object]]) -> Mapping[str, object]:
    """Parameters to show: all of one fibre; of many only those that differ, and only of the set in use.

    Args:
        values: by prefix (see `said_by_files`), then by flat ROS name.
    """
    if "" in values:
        return values[""]
    first = next(iter(values.values()))
    shown: dict[str, object] = {name: first[name] for name in ("model", "method")}
    for prefix, of_one in values.items():
        for name, value in of_one.items():
            if name == "source" or name.startswith(("models.", "constants.")):
                shown[f"{prefix}{name}"] = value
    return shown


def on_top(given: Mapping[str, object], came: Mapping[str, object], named: bool) -> dict[str, object]:
    """What counts of given parameters.

    Args:
        given: by flat ROS name.
        came: those of a whole fibre that the node started with in place of a file.
        named: whether a file is named now; it then stands in the place of what came, where nobody set that otherwise.
    """
    if not named:
        return {**came, **given}
    return {name: value for name, value in given.items() if name not in came or came[name] != value}


def said_by_files(given: Mapping[str, object], of_file: Mapping[str, Mapping[str, object]]) -> list[str]:
    """Names of given parameters that fibres' files say the same of.

    Args:
        given: by flat ROS name.
        of_file: see `Configured`, by prefix: empty for a node of one fibre, a name and a dot for each of many.
    """
    found = []
    for name, value in given.items() if of_file else ():
        head, _, rest = name.partition(".")
        if f"{head}." in of_file:
            same = rest not in given and of_file[f"{head}."].get(rest) == value
        else:
            same = all(values.get(name) == value for values in of_file.values())
        if same:
            found.append(name)
    return found


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
