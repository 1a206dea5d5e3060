"""Coercion at the border: what comes in becomes a contiguous float64 array of a known shape, or one of our errors."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from primitives.errors import InputError, UnknownNameError

Array = NDArray[np.float64]


def array(value: ArrayLike, shape: tuple[int | None, ...], what: str, *, finite: bool = True) -> Array:
    """A fresh contiguous float64 array of the given shape.

    Parameters
    ----------
    value : anything NumPy can turn into numbers.
    shape : expected shape; None stands for any length.
    what : how an error names the value, e.g. "position of Point".
    finite : refuse NaN and infinities.

    Raises
    ------
    InputError : not numbers, another shape, or not finite.
    """
    try:
        out: Array = np.array(value, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise InputError(f"{what}: expected numbers, got {value!r} ({error})") from None
    fits = len(out.shape) == len(shape) and all(e in (None, g) for e, g in zip(shape, out.shape, strict=True))
    if not fits:
        expected = "(" + ", ".join("any" if s is None else str(s) for s in shape) + ")"
        raise InputError(f"{what}: expected shape {expected}, got {out.shape}")
    if finite and not np.isfinite(out).all():
        raise InputError(f"{what}: expected finite numbers, got {out.tolist()}")
    return out


def number(value: Any, what: str, *, low: float | None = None, positive: bool = False) -> float:
    """A finite float, at least `low` or strictly positive where asked.

    Raises
    ------
    InputError : not one finite number, or out of range.
    """
    if isinstance(value, bool) or not np.isscalar(value):
        raise InputError(f"{what}: expected one number, got {value!r}")
    try:
        out = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise InputError(f"{what}: expected one number, got {value!r}") from None
    if not np.isfinite(out):
        raise InputError(f"{what}: expected a finite number, got {out}")
    if positive and out <= 0.0:
        raise InputError(f"{what}: expected a number > 0, got {out:g}")
    if low is not None and out < low:
        raise InputError(f"{what}: expected a number >= {low:g}, got {out:g}")
    return out


def unit(value: ArrayLike, what: str) -> Array:
    """A direction in R^3, scaled to length one.

    Raises
    ------
    InputError : not three finite numbers, or of length zero (below 1e-9).
    """
    vector = array(value, (3,), what)
    length = float(np.linalg.norm(vector))
    if length < 1e-9:
        raise InputError(f"{what}: expected a direction, got a vector of length {length:g}")
    return vector / length


def known(kind: str, name: str, names: Iterable[str]) -> str:
    """The name itself, where it is one of the known ones.

    Raises
    ------
    UnknownNameError : it is not; the nearest known name is proposed.
    """
    names = list(names)
    if name not in names:
        raise UnknownNameError(kind, str(name), names)
    return name
