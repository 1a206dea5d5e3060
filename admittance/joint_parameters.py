"""`JointParameters` of the target admittance in joint coordinates, and a set for each arm."""

from dataclasses import dataclass

import numpy as np

from admittance.parameters import NEURO8
from primitives.checks import Array, array, number
from primitives.errors import InputError

Each = float | tuple[float, ...]


@dataclass(frozen=True)
class JointParameters:
    """What the target admittance is like in each joint: one number for all, or one each.

    Attributes
    ----------
    inertia : M, kg m^2 where the joint is revolute, kg where it slides.
    damping : D, N m s/rad and N s/m.
    k : gain of the barrier potential of constraints, J; 0 for none.
    d_0, d_0_angle : its range, for margins in metres and in radians.

    Raises
    ------
    InputError : not finite, or not > 0; k below 0.
    """

    inertia: Each
    damping: Each
    k: float = NEURO8.k
    d_0: float = NEURO8.d_0
    d_0_angle: float = NEURO8.d_0_angle

    def __post_init__(self) -> None:
        for name in ("k", "d_0", "d_0_angle"):
            what, some = f"{name} of JointParameters", name == "k"
            value = number(getattr(self, name), what, positive=not some, low=0.0 if some else None)
            object.__setattr__(self, name, value)
        for name in ("inertia", "damping"):
            value, what = getattr(self, name), f"{name} of JointParameters"
            numbers = array(value, () if np.isscalar(value) else (None,), what)
            if not numbers.size or not np.all(numbers > 0.0):
                raise InputError(f"{what}: expected numbers > 0, got {numbers.tolist()}")
            object.__setattr__(self, name, float(numbers) if numbers.ndim == 0 else tuple(numbers.tolist()))

    def masses(self, joints: int) -> Array:
        """Diagonal of M (d,); raises InputError where it was given for another number of joints."""
        return _each(self.inertia, joints, "inertia of JointParameters")

    def dampings(self, joints: int) -> Array:
        """Diagonal of D (d,); errors as `masses`."""
        return _each(self.damping, joints, "damping of JointParameters")


def _each(value: Each, joints: int, what: str) -> Array:
    return np.full(joints, value) if isinstance(value, float) else array(value, (joints,), what)


NEURO8_JOINTS = JointParameters(
    inertia=(1.0, 1.0, 0.1, 0.1, 1.0, 0.01, 0.002, 0.002),
    damping=(50.0, 50.0, 5.0, 5.0, 50.0, 0.5, 0.05, 0.05),
)
"""For the 8-dof neurosurgical arm held at its tip: every joint comes to rest with a time constant of 20 to 40 ms.

A force of 1 N moves a slide at 20 mm/s; the tilts, 0.3 m away, move the tip as easily, the wrist, at 16 mm, a quarter
as easily.
"""

LWR4PLUS_JOINTS = JointParameters(
    inertia=(0.5, 0.5, 0.3, 0.3, 0.1, 0.1, 0.05),
    damping=(5.0, 5.0, 3.0, 3.0, 1.0, 1.0, 0.5),
)
"""For the LWR4+ held at its tip: every joint comes to rest with a time constant of 0.1 s.

A force of 1 N moves the tip at 0.09 to 0.49 m/s, by its direction. With lighter joints a hand of 20 N s/m that is
sampled at 8 ms oscillates.
"""
