"""Fibre files: one fibre's constants and a parameter set per model, valid as a ROS parameter file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import yaml

from xb_muscle_ros import fast_yaml
from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.files import installed_folders
from xb_muscle_ros.models.catalogue import starts_for, swapped_in
from xb_muscle_ros.models.fibre import Fibre as Fibre
from xb_muscle_ros.models.parameters import CONSTANTS, PARAMETERS, checked, complete
from xb_muscle_ros.models.registry import METHODS, SEPARATOR, base_of, compose, model_of_set, split_set

_TOP = ("fibre", "model", "method", "source", "sources", "constants", "models")


def fibre_folders() -> Iterator[Path]:
    """Folders where fibre files are looked for: the source tree, then the installed share folders."""
    return installed_folders("config", "fibers")


def find_fibre_file(name_or_path: str | Path) -> Path:
    """Path of a fibre file given as a path, or as the name of a fibre that comes with the package.

    Raises:
        UserError: there is none; known fibres are named.
    """
    path = Path(name_or_path)
    if path.is_file():
        return path
    known: dict[str, Path] = {}
    for folder in fibre_folders():
        for file in sorted(folder.glob("*.yaml")):
            known.setdefault(file.stem, file)
    if str(name_or_path) in known:
        return known[str(name_or_path)]
    if path.suffix in (".yaml", ".yml") or len(path.parts) > 1:
        raise UserError(f"fibre file {path} does not exist; give a YAML file or one of {', '.join(sorted(known))}")
    raise UserError(f"fibre '{name_or_path}' is not known{suggest(str(name_or_path), known)}")


def load_fibre(
    name_or_path: str | Path,
    model: str | None = None,
    method: str | None = None,
    for_fit: bool = False,
    values: Mapping[str, object] | None = None,
) -> Fibre:
    """Read a fibre file.

    Args:
        name_or_path: file, or name of a fibre that comes with the package.
        model: parameter set to pick; the file's default where None.
        method: representation to use; the file's where None.
        for_fit: see `fibre_from_parameters`.
        values: see `fibre_from_parameters`.

    Returns:
        the fibre: values in the units of ``xb_muscle parameters``, L0 in m, F0 in N.

    Raises:
        UserError: file missing or malformed, unknown key, model or parameter, value out of range.

    Source:
        the package's files hold the sets released with van der Zee et al. 2026; each says where it comes from.

    Examples:
        >>> import xb_muscle_ros as xb
        >>> fibre = xb.load_fibre("18Dec2017a", model="2state")
        >>> fibre.model, fibre.method
        ('2state', 'gaussian')
    """
    path = find_fibre_file(name_or_path)
    try:
        tree = fast_yaml.load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"fibre file {path} cannot be read: {error}") from error
    except yaml.YAMLError as error:
        raise UserError(f"fibre file {path} is not valid YAML: {error}; mend the line it names") from error
    inner: object = tree
    for key in ("/**", "ros__parameters"):
        inner = inner.get(key) if isinstance(inner, dict) else None
    if not isinstance(inner, dict):
        raise UserError(
            f"fibre file {path} has no '/**: ros__parameters:' at its top; see config/fibers for files that have"
        )
    flat = dict(_flatten(inner, ""))
    fibre = fibre_from_parameters(flat, f"fibre file {path}", model, method, for_fit, values)
    return replace(fibre, path=path)


def changed(fibre: Fibre, changes: Mapping[str, object], where: str = "changes") -> Fibre:
    """The fibre with other values for some of its model's parameters.

    Args:
        fibre: stays as it is.
        changes: by name, in the units of ``xb_muscle parameters``; each one must be a parameter that the fibre's model
            and method use.
        where: what the messages call the source of the changes.

    Returns:
        another fibre.

    Raises:
        UserError: a name that model and method do not use, or a value out of range.

    Source:
        names, units and bounds: the table of parameters, ``xb_muscle parameters``.

    Examples:
        >>> import xb_muscle_ros as xb
        >>> xb.changed(xb.load_fibre("18Dec2017a"), {"f": 95.0}).values["f"]
        95.0
    """
    values = dict(fibre.values)
    for name, value in changes.items():
        if name not in values:
            raise UserError(
                f"{where}: model {fibre.model} with method {fibre.method} has no parameter '{name}'"
                f"{suggest(name, values)}"
            )
        values[name] = checked(name, value, PARAMETERS, where)
    starts = MappingProxyType({name: tried for name, tried in fibre.starts.items() if name not in changes})
    return replace(fibre, values=MappingProxyType(values), starts=starts)


def _flatten(tree: Mapping[object, object], prefix: str) -> Iterator[tuple[str, object]]:
    for key, value in tree.items():
        if isinstance(value, dict):
            yield from _flatten(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def fibre_from_parameters(
    parameters: Mapping[str, object],
    where: str,
    model: str | None = None,
    method: str | None = None,
    for_fit: bool = False,
    values: Mapping[str, object] | None = None,
) -> Fibre:
    """Build a fibre from flat ROS parameter names such as ``models.3state_coop.f``.

    Args:
        parameters: names and values; every one must be known.
        where: what the messages call the source.
        model: set to pick; the parameter ``model`` where None.
        method: see `load_fibre`.
        for_fit: take parameters of swapped blocks that no set gives from the catalogue of mechanisms, as a start.
        values: in place of those of the source, or where it lacks them; names that the model does not have are left to
            `changed`.

    Raises:
        UserError: see `load_fibre`.
    """
    sets: dict[str, dict[str, float]] = {}
    constants = {name: row.default or 1.0 for name, row in CONSTANTS.items()}
    text: dict[str, str] = {}
    sources: dict[str, str] = {}
    for name, value in parameters.items():
        head, _, rest = name.partition(".")
        if head == "models" and "." in rest:
            set_name, _, parameter = rest.partition(".")
            model_of_set(set_name, where)
            sets.setdefault(set_name, {})[parameter] = checked(
                parameter, value, PARAMETERS, f"{where}, model {set_name}"
            )
        elif head == "sources" and rest:
            model_of_set(rest, where)
            sources[rest] = str(value)
        elif head == "constants" and rest:
            constants[rest] = checked(rest, value, CONSTANTS, where)
        elif name in _TOP[:4]:
            text[name] = str(value)
        else:
            raise UserError(f"{where}: key '{name}' is not known{suggest(head, _TOP)}")
    if "fibre" not in text:
        raise UserError(f"{where}: key 'fibre' is missing; add the name of the fibre")
    if not sets:
        raise UserError(
            f"{where}: there is no parameter set under 'models'; add one, for example 'models: 3state_coop:'"
        )
    chosen = model or text.get("model") or next(iter(sets))
    how = method or text.get("method", "gaussian")
    if how not in METHODS:
        raise UserError(f"{where}: method '{how}' is not known{suggest(how, METHODS)}")
    given = _own_and_base(chosen, sets, where)
    needed = {row.name for row in compose(chosen, how).parameters}
    further = {n: checked(n, value, PARAMETERS, "--set") for n, value in (values or {}).items() if n in needed}
    given = {**given, **further}
    starts = _swapped_starts(chosen, sets, given) if for_fit else {}
    given = {**given, **{name: values[0] for name, values in starts.items()}}
    values = complete(given, model_of_set(chosen), f"{where}, model {chosen}", how)
    return Fibre(
        name=text["fibre"],
        model=chosen,
        method=how,
        values=MappingProxyType(values),
        reference_length_m=constants["reference_length_m"],
        f0_n=constants["f0_n"],
        source=sources.get(chosen) or sources.get(base_set(chosen)) or text.get("source", ""),
        path=None,
        available_models=tuple(sets),
        starts=MappingProxyType(starts),
    )


def base_set(name: str, where: str = "") -> str:
    """Set that a variant's set starts from: ``3state_coop_v3`` of ``3state_coop_rigid_v3``; itself where it is none.

    Raises:
        UserError: no such model.
    """
    model, version = split_set(name, where)
    return base_of(model) + version


def borrowed_line(fibre: Fibre) -> str:
    """One line where a fibre's model uses the set of its base, mechanisms aside; empty where it has its own."""
    if {fibre.model, fibre.model.split(SEPARATOR)[0]} & set(fibre.available_models):
        return ""
    base = base_set(fibre.model)
    return f"model {fibre.model} has no parameter set of fibre {fibre.name}; that of {base} is used, as far as it goes"


def _own_and_base(chosen: str, sets: Mapping[str, dict[str, float]], where: str) -> dict[str, float]:
    """Values of a set, started from sets that it can use, as far as it has use for their values.

    A variant such as ``3state_coop_rigid`` starts from the set of its base, one with mechanisms from that without.

    Raises:
        UserError: none of these has a set here.
    """
    base, bare = base_set(chosen, where), chosen.split(SEPARATOR)[0]
    if chosen in sets and base == chosen:
        return sets[chosen]
    chain = [name for name in dict.fromkeys((base, bare, chosen)) if name in sets]
    if not chain:
        nor = "" if base == chosen else f", nor has '{base}'"
        raise UserError(f"{where}: model '{chosen}' has no parameter set here{nor}; there are {', '.join(sets)}")
    wanted = {row.name for row in compose(chosen).parameters}
    found: dict[str, float] = {}
    for name in chain:
        if name == chosen:
            found.update(sets[name])
        else:
            known = {row.name for row in compose(name).parameters}
            found.update({key: value for key, value in sets[name].items() if key in wanted or key not in known})
    return found


def _swapped_starts(
    chosen: str, sets: Mapping[str, dict[str, float]], given: Mapping[str, float]
) -> dict[str, tuple[float, ...]]:
    """The catalogue's values for swapped blocks of which no set gives a parameter."""
    # What the block replaces tells where its own parameters may start.
    base = {**sets.get(base_set(chosen), {}), **sets.get(chosen.split(SEPARATOR)[0], {}), **given}
    found: dict[str, tuple[float, ...]] = {}
    for entry in swapped_in(chosen):
        starts, some = starts_for(entry, base), any(name in given for name in entry.parameters)
        # With none of its own values the block takes the whole start, which may move others (more attachment, say).
        found.update({n: v for n, v in starts.items() if not some or (n in entry.parameters and n not in given)})
    return found
