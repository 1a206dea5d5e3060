"""`Guide`: a hand that holds the tool and leads its pose along a trajectory, as hard as it can but no harder."""

from dataclasses import dataclass, fields

import numpy as np

from admittance.hand import Hand, Tremor
from primitives import dual_quaternion as dq
from primitives.checks import Array, number


def turn(x: Array, x_d: Array) -> Array:
    """(3,) rotation vector, rad, world axes, of at most half a turn from the orientation of a pose (8,) to another."""
    r = x[:4] * np.array([1.0, -1.0, -1.0, -1.0])
    q = dq.quaternion_product(np.ascontiguousarray(x_d[:4]), r)
    if q[0] < 0.0:
        q = -q
    sine = float(np.linalg.norm(q[1:]))
    # Near zero the angle is twice the sine.
    factor = 2.0 * np.arctan2(sine, q[0]) / sine if sine > 1e-12 else 2.0
    out: Array = factor * q[1:]
    return out


def offset(x: Array, x_d: Array) -> Array:
    """(3,) metres, world axes, from the origin of a pose (8,) to that of another."""
    out: Array = dq.translation(np.ascontiguousarray(x_d)) - dq.translation(np.ascontiguousarray(x))
    return out


@dataclass(frozen=True)
class Guide:
    """A spring and a damper between the tool's pose and where the hand wants it.

    Attributes
    ----------
    stiffness, damping, most : along the offset of the positions; N/m, N s/m and N.
    turning_stiffness, turning_damping, most_torque : along the rotation vector between the orientations; N m/rad,
        N m s/rad and N m.
    tremor : rms of a force of 8 to 12 Hz on top, N.

    Raises
    ------
    InputError : a number out of range.
    """

    stiffness: float = 1000.0
    damping: float = 20.0
    most: float = 20.0
    turning_stiffness: float = 4.0
    turning_damping: float = 0.1
    most_torque: float = 1.0
    tremor: float = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            what, most = f"{field.name} of the hand", field.name.startswith("most")
            value = number(getattr(self, field.name), what, positive=most, low=None if most else 0.0)
            object.__setattr__(self, field.name, value)

    def hand(self, reference: Array, period: float, seed: int) -> Hand:
        """The hand itself, for a reference (k, 8) at t = 0, T, 2 T, ...; seed is that of its tremor.

        It is asked like every `admittance.hand.Hand`, with the tool's pose (8,) and twist (6,) in the place of the
        handle's position and velocity.
        """
        hand: Hand = GuidingHand(self, reference, period)
        return Tremor(hand, rms=self.tremor, seed=seed) if self.tremor > 0.0 else hand


@dataclass(frozen=True, eq=False)
class GuidingHand:
    """The hand of a `Guide`, with the poses (k, 8) that it wants at t = 0, T, 2 T, ...; the last one stays."""

    guide: Guide
    reference: Array
    period: float

    def wrench(self, t: float, pose: Array, twist: Array) -> Array:
        """(6,) [force; torque] at the tool's origin, N and Nm, world axes, for its pose (8,) and twist (6,)."""
        g, wanted = self.guide, self.reference[min(round(t / self.period), len(self.reference) - 1)]
        force = g.stiffness * offset(pose, wanted) - g.damping * twist[:3]
        torque = g.turning_stiffness * turn(pose, wanted) - g.turning_damping * twist[3:]
        return np.concatenate([_at_most(force, g.most), _at_most(torque, g.most_torque)])

    def reset(self) -> None:
        """Nothing is remembered."""


def _at_most(value: Array, most: float) -> Array:
    size = float(np.linalg.norm(value))
    return value * (most / size) if size > most else value
