"""What is known of a pair of elements: which elements, the unit of its distance, and its kernel."""

from collections.abc import Callable, Mapping
from typing import Literal, NamedTuple

from primitives.checks import Array

Kernel = Callable[[Array, Array, Array], tuple[float, int]]


class Pair(NamedTuple):
    """A pair of elements between which a distance is defined.

    Attributes
    ----------
    name : e.g. "line_point"; the file that defines it has the same name.
    first, second : the kinds of the elements, "point", "line", "plane", "segment" or "cloud".
    unit : of the distance, "m" or "rad".
    kernel : compiled with `PAIR_SIGNATURE`; see `primitives.pairs`. None for a cloud, which is searched by its grid.
    """

    name: str
    first: str
    second: str
    unit: Literal["m", "rad"]
    kernel: Kernel | None


CLOUD_PAIRS: Mapping[str, Pair] = {
    f"{first}_cloud": Pair(f"{first}_cloud", first, "cloud", "m", None) for first in ("point", "segment")
}
"""The pairs of a part of the tool and a point cloud; see `primitives.cloud_rows`."""
