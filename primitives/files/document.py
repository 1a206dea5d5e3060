"""What a file holds, where each value stands, and what is wrong with it: one error for all of a file's problems."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, NoReturn

from primitives.errors import FileError

MAX_PROBLEMS = 20
"""An error names this many problems and says whether there are others."""

MAX_MESSAGE = 600
"""Characters of one problem that are shown."""

ValuePath = tuple[str | int, ...]
"""Keys and indices from the top of a file to a value."""


def printable(text: str) -> str:
    """Text from a file with escapes for what would steer a terminal."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


class Mark(NamedTuple):
    """Where something stands, as file:line; line 0 where lines are not known."""

    file: str
    line: int

    def __str__(self) -> str:
        return printable(f"{self.file}:{self.line}" if self.line else self.file)


class Problem(NamedTuple):
    """One thing that is wrong: where, with which value, and what to do, in words or by what will make the words."""

    mark: Mark
    path: ValuePath
    message: str | Callable[[], str]


@dataclass(frozen=True)
class Document:
    """What a file holds.

    Attributes
    ----------
    data : dicts with text as keys, lists, text, numbers, booleans and None.
    marks : where each value's key, or a list's item, stands; () is the file itself and always there.
    problems : what is wrong so far; the values concerned are left out of the data.
    """

    data: Any
    marks: Mapping[ValuePath, Mark]
    problems: tuple[Problem, ...] = ()

    def mark(self, path: ValuePath) -> Mark:
        """Where a value stands; for one that is not there, where the nearest one around it does."""
        while path not in self.marks:
            path = path[:-1]
        return self.marks[path]


def in_words(path: ValuePath) -> str:
    """A path as people write it: constraints[0].first.direction."""
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path).removeprefix(".")


def _words(problem: Problem) -> str:
    text = problem.message if isinstance(problem.message, str) else problem.message()
    return printable(text if len(text) <= MAX_MESSAGE else text[: MAX_MESSAGE - 4] + " ...")


def refuse(problems: Iterable[Problem]) -> NoReturn:
    """Raise one FileError that names every problem, one a line, in the order of each file's lines."""
    items = list(problems)
    order = {file: i for i, file in enumerate(dict.fromkeys(p.mark.file for p in items))}
    items.sort(key=lambda p: (order[p.mark.file], p.mark.line))
    first, *others = items[:MAX_PROBLEMS]
    lines = [_words(first), *(f"{p.mark}: {_words(p)}" for p in others)]
    if len(items) > MAX_PROBLEMS:
        lines.append("... and more")
    raise FileError(str(first.mark), "\n".join(lines)) from None
