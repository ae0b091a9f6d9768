"""The errors a user sees: one line that names the thing, the value, what is allowed and the remedy."""

from __future__ import annotations

import contextlib
import difflib
from collections.abc import Iterable, Iterator


class UserError(Exception):
    """Something the user can mend; the command line prints it on one line and exits with code 2.

    The message names the file, fibre, parameter, state or time at fault, the value found, what is allowed, and
    what to do. It is made one printable line, because logs and terminals are read line by line.
    """

    def __init__(self, message: str) -> None:
        super().__init__(one_line(message))


class DataWarning(UserWarning):
    """Something was guessed, left out or taken for granted; one line that names it."""

    def __init__(self, message: str) -> None:
        super().__init__(one_line(message))


def one_line(text: str) -> str:
    """A text with line breaks folded away; what cannot be printed (a name's NUL, an escape) is shown by its code."""
    folded = " ".join(text.split())
    if folded.isprintable():
        return folded
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in folded)


class StateViolation(UserError):
    """The integration left the states a fibre can have.

    Attributes:
        fibre: name of the fibre.
        state: name of the state that was violated, for example ``n_on``.
        time_s: time of the violation in s.
        value: the value the state took.
    """

    def __init__(self, fibre: str, state: str, time_s: float, value: float, allowed: str, remedy: str) -> None:
        super().__init__(
            f"fibre {fibre}: state {state} became {value:.6g} at t = {time_s:.6g} s; allowed is {allowed}; {remedy}"
        )
        self._made_of = (fibre, state, time_s, value, allowed, remedy)
        self.fibre = fibre
        self.state = state
        self.time_s = time_s
        self.value = value

    def __reduce__(self) -> tuple[object, ...]:
        """Pickled by what it was made of: one text, as for other errors, does not make it anew in another process."""
        return type(self), self._made_of, {"args": self.args}


@contextlib.contextmanager
def naming(what: str) -> Iterator[None]:
    """Put what was at work before the message of an error that comes out of the block: ``trial x: fibre y: ...``."""
    try:
        yield
    except UserError as error:
        error.args = (f"{what}: {error}",)
        raise


_MOST_NAMES = 40
_NEAREST = 4


def suggest(word: str, known: Iterable[str]) -> str:
    """Return ``; did you mean 'x'?`` for the nearest of the known names, or the list of them; of many the nearest."""
    names = sorted(known)
    near = difflib.get_close_matches(word, names, n=1, cutoff=0.5)
    if near:
        return f"; did you mean '{near[0]}'?"
    if len(names) <= _MOST_NAMES:
        return f"; known: {', '.join(names)}"
    near = difflib.get_close_matches(word, names, n=_NEAREST, cutoff=0.0)
    return f"; nearest of {len(names)} known: {', '.join(near)}"
