"""The procedural anatomies of the hands-on scenes, each of the size of its arm; nothing has to be downloaded for them.

Lengths follow the scenes' tools, not a patient: an organ of 110 mm with vessels of 6 to 16 mm for the LWR4+, a bowl of
12 mm radius with vessels of 1 to 2 mm for the neurosurgical arm. In their frames +z looks to the tool.
"""

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from primitives.checks import Array, number
from scenarios.anatomy.bowl import Bowl
from scenarios.anatomy.ellipsoid import Ellipsoid
from scenarios.anatomy.shape import Shape
from scenarios.anatomy.vessels import Branch, Vessels

_PIECES = 16
"""Capsules along one branch: its centre line is met to 0.4 % of its length."""


class Anatomy(NamedTuple):
    """An organ and the vessels beside it, in one frame."""

    organ: Shape
    vessels: Vessels

    def placed(self, pose: ArrayLike) -> Self:
        """Both at a pose (8,) of their frame in the world."""
        return type(self)(self.organ.placed(pose), self.vessels.placed(pose))


def kidney() -> Anatomy:
    """An ellipsoid of 110 mm with a branching artery and vein at its side and a piece of the vessel they come from.

    The organ's middle is the origin, its long axis y; the vessels lie at +x and, in part, in front of it.
    """
    fork, vein = (40.0, 2.0, 12.0), (44.0, -10.0, 20.0)
    branches = (
        # What artery and vein come from.
        _branch([(78, -55, 0), (77, -20, 3), (79, 20, 3), (76, 55, 0)], 8.0, 7.5),
        # The artery, and its three branches into the organ.
        _branch([(78, 0, 2), (66, 4, 12), (52, 4, 14), fork], 4.2, 3.8),
        _branch([fork, (30, 10, 12), (22, 22, 10), (12, 30, 4)], 3.4, 3.0),
        _branch([fork, (32, 2, 12), (26, 4, 8), (16, 5, 2)], 3.4, 3.0),
        _branch([fork, (32, -4, 8), (24, -14, 4), (14, -26, 0)], 3.4, 3.0),
        # The vein in front of the artery, and its two branches.
        _branch([(78, -14, 4), (68, -14, 18), (56, -12, 22), vein], 6.0, 5.0),
        _branch([vein, (34, -8, 19), (26, 4, 18), (18, 14, 12)], 4.4, 3.2),
        _branch([vein, (36, -14, 18), (26, -22, 14), (14, -34, 6)], 4.2, 3.2),
    )
    return Anatomy(Ellipsoid(np.array([0.027, 0.055, 0.022])), Vessels.tree(branches, _PIECES))


def cortex() -> Anatomy:
    """A bowl of 12 mm radius, open upwards, along whose wall a vessel of 2 mm branches into two of 1 mm.

    The middle of the bowl's sphere is the origin.
    """
    bowl = Bowl(0.012, np.radians(80.0))
    main = _on_sphere(bowl.radius, [(-60, 75), (-30, 52), (-10, 40), (10, 30)], 1.0, 0.8)
    left = _on_sphere(bowl.radius, [(10, 30), (40, 22), (95, 30), (110, 50)], 0.7, 0.5)
    right = _on_sphere(bowl.radius, [(10, 30), (-5, 18), (-150, 20), (-160, 48)], 0.7, 0.5)
    return Anatomy(bowl, Vessels.tree((main, left, right), _PIECES))


def bowl_for(gap: float, radius: float, opening: float = np.radians(80.0)) -> tuple[Bowl, Array]:
    """A bowl, and the point (3,) of its frame that lies a gap above its lowest point on its axis, metres."""
    bowl = Bowl(radius, opening)
    return bowl, np.array([0.0, 0.0, number(gap, "gap above the bowl, metres", positive=True) - bowl.radius])


def _branch(control: Sequence[tuple[float, float, float]], first: float, last: float) -> Branch:
    """A branch in millimetres."""
    return Branch([1e-3 * np.array(p) for p in control], 1e-3 * first, 1e-3 * last)


def _on_sphere(radius: float, control: Sequence[tuple[float, float]], first: float, last: float) -> Branch:
    """A branch whose control points lie on a sphere, at azimuths and polar angles from -z in degrees; radii in mm."""
    azimuth, polar = np.radians(np.array(control, dtype=float)).T
    x, y, z = np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), -np.cos(polar)
    return Branch(list(radius * np.stack([x, y, z], axis=1)), 1e-3 * first, 1e-3 * last)
