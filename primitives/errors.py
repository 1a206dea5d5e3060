"""The exception family of the whole project.

Every error says what was got, what was expected, which names are known and what to do about it. All derive from
`ActiveConstraintsError`; those caused by a value also derive from `ValueError`, so that a caller who knows nothing
of this project can still catch them.
"""

from collections.abc import Iterable
from difflib import get_close_matches


class ActiveConstraintsError(Exception):
    """Base of every exception that this project raises on purpose."""


class InputError(ActiveConstraintsError, ValueError):
    """A value handed in at the border is not usable: wrong shape, not finite, out of range."""


class UnknownNameError(InputError):
    """A name that nothing is registered or declared under.

    Parameters
    ----------
    kind : what the name stands for, e.g. "frame" or "solver".
    name : the name that was got.
    known : the names that would have been accepted.
    """

    def __init__(self, kind: str, name: str, known: Iterable[str]):
        self.kind, self.name, self.known = kind, name, sorted(known)
        folded = {k.casefold(): k for k in self.known}
        near = get_close_matches(name, self.known, n=1) or get_close_matches(name.casefold(), folded, n=1)
        hint = f' Did you mean "{folded.get(near[0], near[0])}"?' if near else ""
        listing = ", ".join(self.known) if self.known else "none are declared"
        super().__init__(f'unknown {kind} "{name}".{hint} Known: {listing}.')


class ModelError(InputError):
    """A robot description that cannot be used, e.g. a joint of an unsupported type."""


class FileError(InputError):
    """Something in a file is wrong; `place` names it as file:line.

    Parameters
    ----------
    place : "file:line" (or "file" where a line makes no sense).
    message : what was got, what was expected, what to do.
    """

    def __init__(self, place: str, message: str):
        self.place = place
        super().__init__(f"{place}: {message}")


class InactiveConstraintError(InputError):
    """A declared, enforced constraint that no decided joint can influence: it would yield no row."""


class SolverError(ActiveConstraintsError):
    """A solver is missing or cannot take the problem it was given."""
