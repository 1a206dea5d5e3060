"""The table of pairs."""

from typing import cast

from primitives import pairs as built_in
from primitives.errors import InputError
from primitives.intrinsics import address_of
from primitives.pair import Kernel, Pair
from primitives.plugins import Registry


def _check(pair: Pair) -> None:
    if not isinstance(pair, Pair):
        raise InputError(f"expected a Pair, got {pair!r}")
    if pair.unit not in ("m", "rad"):
        raise InputError(f'pair "{pair.name}": expected the unit "m" or "rad", got {pair.unit!r}')
    try:
        address_of(cast(Kernel, pair.kernel))
    except (AttributeError, KeyError):
        raise InputError(
            f'pair "{pair.name}": its kernel is not compiled; decorate it with @compiled(PAIR_SIGNATURE)'
        ) from None


pairs: Registry[Pair] = Registry("pair", built_in, "PAIR", _check)
"""Every pair of elements between which a distance is defined."""
