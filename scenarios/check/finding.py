"""`Finding`: one thing that somebody should know before a scene runs, and `Part`: what one concern found."""

from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import Any, NamedTuple


class Severity(StrEnum):
    """From what stops a run to what is only good to know."""

    ERROR = "error"
    """The scene cannot run, or cannot do what it declares."""
    WARNING = "warning"
    """It runs, and something of it is probably not meant."""
    NOTE = "note"
    """Meant or not, it will show in the run."""


class Finding(NamedTuple):
    """One thing that was found.

    Attributes
    ----------
    severity : see `Severity`.
    check : the concern that found it, e.g. "start".
    where : the constraint, joint, part of the anatomy or waypoint that it is about.
    what : the sentence, with its numbers in it.
    advice : what to do about it.
    numbers : {name with its unit: value} for programs, SI.
    place : file:line where it stands, empty where that is not known.
    """

    severity: Severity
    check: str
    where: str
    what: str
    advice: str
    numbers: Mapping[str, float]
    place: str = ""


class Part(NamedTuple):
    """What one concern found.

    Attributes
    ----------
    name : of the concern.
    rows : a table of it, plain data, SI. findings : what is worth a sentence. method : how it was looked for.
    """

    name: str
    rows: Sequence[Mapping[str, Any]]
    findings: Sequence[Finding] = ()
    method: str = ""


def amount(value: float, unit: str) -> str:
    """A value with its unit as people read it: mm for metres, deg for radians."""
    factor, shown = {"m": (1e3, "mm"), "rad": (57.29577951308232, "deg")}.get(unit.removesuffix("/s"), (1.0, unit))
    rate = "/s" if unit.endswith("/s") and shown != unit else ""
    scaled = value * factor
    text = f"{scaled:.2f}" if 0.1 <= abs(scaled) < 1e5 or scaled == 0.0 else f"{scaled:.2g}"
    return f"{text} {shown}{rate}"
