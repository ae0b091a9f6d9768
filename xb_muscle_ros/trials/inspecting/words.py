"""Words by which laboratories call their signals, in several languages, and what they write for units."""

from __future__ import annotations

import re
import unicodedata
from typing import NamedTuple

from xb_muscle_ros.trials.readers.units import KINDS, UNITS, simple

# Words for each role; accents and case play no part. A single letter counts where it is the whole name.
_WORDS = {
    "time": "time times zeit temps tiempo tempo tid tijd aika czas cas seconds 时间 時間 время",
    "length": (
        "length len lengths fl ml lm lmt lmtu lmtc mtu lin lout position pos sl lange laenge longueur longitud "
        "lunghezza comprimento lengte langd laengde længde pituus długość dlugosc delka délka "
        "长度 長さ длина displacement deplacement auslenkung stretch strain dl dlength lexp"
    ),
    "force": (
        "force forces fin fout tension stress kraft spannung load loadcell fuerza forza forca kracht voima siła sila "
        "力 张力 張力 сила tensione fexp fm fmt"
    ),
    "calcium": "calcium ca ca2 cai pca kalzium calcio kalsium wapn vapnik 钙 钙离子 カルシウム кальций freeca",
    "stimulation": "stim stimulus stimulation reiz stimulatie estimulo estimulacion stimolo стимул 刺激",
    "trial": "trial sweep versuch essai ensayo prova",
}
_LETTERS = {"t": "time", "L": "length", "l": "length", "F": "force", "f": "force", "σ": "force", "ε": "length"}
# With these a name is of something else, though it has a word of a role in it.
_OTHERWISE = {
    "is another quantity": (
        "velocity speed vel rate power work stiffness temperature temp width diameter area csa angle torque moment "
        "slope geschwindigkeit vitesse velocidad"
    ),
    "is a statistic": "sd se sem std var variance noise error residual ci",
    "is made by a model": "simulated model predicted fit fitted simulation",
    "is a part of the muscle": "ce see sec tendon pennation",
    "is of another time": "date clock day stamp",
}
_COMMANDS = {
    *("command", "cmd", "commanded", "target", "set", "setpoint", "soll", "lout", "fout", "demand", "reference", "ref"),
    *("desired", "input"),
}
_CHANGES = {
    *("change", "dl", "delta", "dlength", "displacement", "deplacement", "auslenkung", "stretch", "strain", "δ", "ε"),
    "aenderung",
}
# What such names are of has no unit: a share of L0 or F0.
_NORMALISED = {"normalized", "normalised", "norm", "multiplier", "strain"}
_SARCOMERES = {"sl": "sarcomere", "sarcomere": "sarcomere", "sarkomer": "sarcomere", "hs": "half_sarcomere"}
# Spellings of units; what is not here is compared with the units themselves.
_SPELLINGS = {
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "sekunden": "s", "msec": "ms", "millisecond": "ms",
    "milliseconds": "ms", "usec": "us", "micron": "um", "microns": "um", "micrometer": "um", "micrometers": "um",
    "_": "1", "-": "1", "–": "1",
    "l/l0": "L0", "l/lo": "L0", "lo": "L0", "l0": "L0", "ml0": "L0", "%l0": "%L0", "%lo": "%L0",
    "f/f0": "F0", "f/fo": "F0", "p/p0": "F0", "p/po": "F0", "t/t0": "F0", "t/to": "F0", "f/fmax": "F0", "fo": "F0",
    "f0": "F0", "p0": "F0", "po": "F0", "%f0": "%F0", "%fo": "%F0", "%p0": "%F0", "%po": "%F0", "kn/m2": "kPa",
    "n/m2": "Pa", "n/mm2": "MPa", "newton": "N", "newtons": "N", "gf": "g", "gram": "g", "grams": "g", "volt": "V",
    "volts": "V", "-log m": "pCa", "umol/l": "uM", "nmol/l": "nM", "mmol/l": "mM", "mol/l": "M",
}  # fmt: skip
# Units of other things, or ones that import does not read, and what to do about them.
OTHER_UNITS = {
    "deg": "an angle", "rad": "an angle", "°c": "a temperature",
    "degc": "a temperature", "nm/s": "a speed", "mm/s": "a speed", "m/s": "a speed", "l0/s": "a speed",
    "nm.": "a torque", "w": "a power", "a": "a current", "ma": "a current", "samples": "a number of samples",
    "pixel": "pixels", "px": "pixels", "au": "arbitrary units", "a.u.": "arbitrary units", "min": "minutes",
}  # fmt: skip
_MASSES = ("kg", "g", "mg")
_ABBREVIATIONS = {unit.casefold() for unit in (*_MASSES, "Pa")}
_BRACKETS = re.compile(r"^(?P<name>.*?)\s*[(\[{](?P<unit>[^()\[\]{}]*)[)\]}]\s*$")
_INDEX = re.compile(r"(?=.*(?::|trial))[\d:,\s]*(?:trial)?[\d:,\s]*")
_SLASH = re.compile(r"^(?P<name>.+?)\s+(?:/|in|,)\s+(?P<unit>\S+)$|^(?P<name2>.+?),\s*(?P<unit2>\S+)$")
_END = re.compile(r"^(?P<name>.*[^\W_])[\s_]+(?P<unit>%?[^\W_][^\s_]*)$")


class Named(NamedTuple):
    """What a name tells.

    Attributes:
        roles: that its words are of; several where they contradict each other.
        unit: as written in the name; empty for none.
        why_not: why the signal is none for an import, though its words are of a role; empty where it may be one.
        is_command: it is what was asked for, not what was measured.
        is_change: of length.
        length_of: what it is a length of, as a mapping has it; empty for the fibre.
        is_normalised: it is a share of L0 or F0.
    """

    roles: tuple[str, ...]
    unit: str
    why_not: str = ""
    is_command: bool = False
    is_change: bool = False
    length_of: str = ""
    is_normalised: bool = False


def units_meant(text: str) -> tuple[str, ...]:
    """Units, as a mapping has them, that a text may mean, the likeliest first: ``um`` may be micrometres or µM."""
    plain = simple(text)
    if plain in UNITS:
        exact: tuple[str, ...] = (plain,)
    elif plain.casefold() in _SPELLINGS:
        exact = (_SPELLINGS[plain.casefold()],)
    else:
        exact = ()
    alike = tuple(unit for unit in UNITS if unit.casefold() == plain.casefold() and unit not in exact)
    return tuple(unit for unit in (*exact, *alike) if unit != "1" or plain in ("1", "_", "-", "–"))


def fitting(text: str, role: str) -> str:
    """The unit of a role that a text means; empty where it means none."""
    return next((unit for unit in units_meant(text) if UNITS[unit].kind in KINDS.get(role, ())), "")


def roles_of_unit(text: str) -> tuple[str, ...]:
    """Roles that a unit, as it is written exactly, belongs to."""
    meant = units_meant(text)[:1]
    if meant and meant[0] in _MASSES:  # what has no name of a force may be a mass
        return ()
    return tuple(role for role, kinds in KINDS.items() if role != "rate" and meant and UNITS[meant[0]].kind in kinds)


def _is_abbreviation(unit: str) -> bool:
    """Whether what ends a name is a unit by its letters alone: ``Force_MG`` is of a muscle, ``F_pa`` is passive."""
    return unit not in UNITS and unit.casefold() in _ABBREVIATIONS


def read_name(name: str) -> Named:
    """What a column, channel or joint is by its name."""
    rest, unit = _split(unicodedata.normalize("NFKC", name).strip())
    words = _words(rest)
    roles = dict.fromkeys(_LETTERS[rest] for _ in (0,) if rest in _LETTERS)
    for role, known in _KNOWN.items():
        if any(word in known for word in words):
            roles[role] = None
    why_not = next((why for why, known in _KNOWN_OTHERWISE.items() if any(word in known for word in words)), "")
    if "calcium" in roles and "pca" in words and not fitting(unit, "calcium"):
        unit = unit or "pCa"
    found = [_SARCOMERES[word] for word in words if word in _SARCOMERES]
    length_of = "half_sarcomere" if found and "half" in words else found[0] if found else ""
    if length_of:
        roles["length"] = None
    spelt = {*words, rest.casefold()[:1] if rest[:1] in "Δδε" else ""}
    return Named(
        tuple(roles),
        unit,
        why_not,
        is_command=bool(_COMMANDS & set(words)),
        is_change=bool((_CHANGES | {"δ"}) & spelt),
        length_of=length_of,
        is_normalised=bool(_NORMALISED & set(words)),
    )


def _split(name: str) -> tuple[str, str]:
    """The name without its unit, and the unit as written."""
    match = _BRACKETS.match(name)
    if match is not None and match.group("unit").strip():
        # force(:,trial) of MATLAB has an index there.
        unit = "" if _INDEX.fullmatch(match.group("unit")) else match.group("unit").strip()
        return match.group("name").strip(), unit
    for pattern in (_SLASH, _END):
        match = pattern.match(name)
        if match is None:
            continue
        parts = match.groupdict()
        rest, unit = parts["name"] or parts["name2"], parts["unit"] or parts["unit2"]
        known = units_meant(unit) and unit != "1" and not _is_abbreviation(unit)
        if known or (len(unit) > 1 and unit.casefold() in OTHER_UNITS):
            return rest.strip(), unit
    return name, ""


def _words(name: str) -> tuple[str, ...]:
    """Words of a name, folded: ``fibreLength`` is two, ``Länge`` is ``lange``."""
    spaced = re.sub(r"(?<=[a-zà-ÿ])(?=[A-ZÀ-Þ])", " ", re.sub("pCa", "pca", name))
    return tuple(_folded(word) for word in re.findall(r"[^\W\d_]+\d?", spaced))


def _folded(word: str) -> str:
    stripped = "".join(c for c in unicodedata.normalize("NFKD", word.casefold()) if not unicodedata.combining(c))
    return stripped.replace("ß", "ss")


_KNOWN = {role: {_folded(word) for word in text.split()} for role, text in _WORDS.items()}
_KNOWN_OTHERWISE = {why: {_folded(word) for word in text.split()} for why, text in _OTHERWISE.items()}
