"""Units of length that files come in, and whether a thing has the size that its scene expects."""

from math import log10

from primitives.checks import known, number
from primitives.errors import InputError

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001}
"""Metres in each unit that can be named."""

TOLERATED = 10.0
"""Times larger or smaller than expected, within which a size is believed."""


def metres(unit: str) -> float:
    """Metres in one unit "m", "cm" or "mm"; raises UnknownNameError for another."""
    return METRES[known("unit of length", unit, METRES)]


def check_size(extent: float, expected: float, *, unit: str = "m", what: str = "surface") -> None:
    """Refuse a size that can only be that of another unit: a kidney of 90 m is one in millimetres.

    Parameters
    ----------
    extent : longest side of the thing's bounding box, metres, as read in that unit.
    expected : about how large the scene expects it, metres.
    unit : in which it was read. what : how the error names it.

    Raises
    ------
    InputError : more than ten times larger or smaller than expected; names the unit that fits best, if one does.
    """
    if extent / TOLERATED <= number(expected, "expected size, metres", positive=True) <= extent * TOLERATED:
        return
    said = f"{what}: it is {extent:.3g} m long and something of about {expected:.3g} m was expected"
    if extent > 0.0:
        others = {u: extent * size / metres(unit) for u, size in METRES.items() if u != unit}
        best = min(others, key=lambda u: abs(log10(others[u] / expected)))
        if expected / TOLERATED <= others[best] <= expected * TOLERATED:
            name = {"m": "metres", "cm": "centimetres", "mm": "millimetres"}[best]
            raise InputError(f'{said}; looks like {name}; give unit "{best}"')
    raise InputError(f"{said}; no unit of {', '.join(METRES)} explains that: is it the right file?")
