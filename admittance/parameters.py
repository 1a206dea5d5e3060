"""`Parameters` of the target admittance: paper A's Table 1 and a set for the 8-dof neurosurgical arm."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from primitives.checks import Array, array, number
from primitives.errors import InputError

Four = tuple[float, float, float, float]
_FOURS = ("inertia", "D_c", "Q", "M", "G", "C")


@dataclass(frozen=True)
class Parameters:
    """What the target admittance is like; four numbers stand for [along the shaft, about the port x 3].

    Attributes
    ----------
    inertia : kg, kg m^2 x 3. Paper A has none: (22) implies 1 kg along the shaft and 1 kg m^2 about the port.
    D_c : constant damping of (43), N s/m, N m s/rad x 3.
    Q, M : damping at rest that fades with speed, Q exp(-M s) (44); N s/m and s/m, N m s/rad and s/rad x 3.
    G, C : damping that grows with the repulsion, G (1 - exp(-C z^2)) (45); N s/m and 1/N^2, N m s/rad and 1/(N m)^2.
    redundant_inertia, redundant_damping : of every coordinate of a motion that leaves the shaft alone; kg m^2 and
        N m s/rad where the joint is revolute (kg and N s/m where it slides).
    alpha, beta : gains of x_c's dynamics in the full form (25), 1/s; critically damped where they are equal.
    port_gain : gain of x_c's dynamics in the reduced form, dx_c/dt = -port_gain x_c, 1/s. Paper A has none; what a
        step of 4 ms adds to x_c in guided motion is kept below 1e-6 m by 100 1/s, in fast slips below 2e-5 m.
    W : weights of the inverses (19): one number for all joints, which cancels, or one each.
    k : gain of the barrier potential (9), J.
    d_0 : range of the barrier potential beyond the safe distance, metres.
    d_0_angle : its range for margins that are angles, rad. Paper A has none; it is d_0 seen from the port, so that a
        cone about the port is felt at the end of the shaft like a wall there.
    shaft_length : from the shaft frame back along its axis to the handle, where the wrench is measured by default
        (p_e, and paper A's L), metres.
    implicit_damping : take the damping at the new velocity, (M + T D) v+ = M v + T f.

    Raises
    ------
    InputError : wrong size, not finite, or out of range; names the field.
    """

    inertia: Four = (1.0, 1.0, 1.0, 1.0)
    D_c: Four = (10.0, 4.0, 4.0, 4.0)
    Q: Four = (25.0, 20.0, 20.0, 20.0)
    M: Four = (22.0, 19.0, 19.0, 19.0)
    G: Four = (60.0, 30.0, 30.0, 30.0)
    C: Four = (0.01, 0.2, 0.2, 0.2)
    redundant_inertia: float = 1.0
    redundant_damping: float = 60.0
    alpha: float = 25.0
    beta: float = 25.0
    port_gain: float = 100.0
    W: float | tuple[float, ...] = 1.5
    k: float = 0.01
    d_0: float = 0.0115
    d_0_angle: float = 0.09
    shaft_length: float = 0.43
    implicit_damping: bool = False

    def __post_init__(self) -> None:
        for field in fields(self):
            value, what = getattr(self, field.name), f"{field.name} of Parameters"
            if field.name in _FOURS:
                numbers = tuple(array(value, (4,), what).tolist())
                if min(numbers) < 0.0:
                    raise InputError(f"{what}: expected four numbers >= 0, got {numbers}")
                object.__setattr__(self, field.name, numbers)
            elif field.name == "W":
                object.__setattr__(self, "W", _weights(value, what))
            elif field.name == "implicit_damping":
                object.__setattr__(self, field.name, bool(value))
            else:
                low = field.name in ("k", "shaft_length")
                object.__setattr__(self, field.name, number(value, what, positive=not low, low=0.0 if low else None))
        if min(self.inertia) <= 0.0 or min(self.D_c) <= 0.0:
            raise InputError(f"inertia and D_c of Parameters: expected > 0, got {self.inertia} and {self.D_c}")

    def masses(self, coordinates: int) -> Array:
        """Diagonal of the inertia M (m,), for m free coordinates."""
        return np.array([*self.inertia, *[self.redundant_inertia] * (coordinates - 4)])

    def weights(self, joints: int) -> Array:
        """Diagonal of W (d,); raises InputError where it was given for another number of joints."""
        if isinstance(self.W, float):
            return np.full(joints, self.W)
        return array(self.W, (joints,), "W of Parameters")


def _weights(value: ArrayLike, what: str) -> float | tuple[float, ...]:
    if np.isscalar(value):
        return number(value, what, positive=True)
    numbers = array(value, (None,), what)
    if not np.all(numbers > 0.0):
        raise InputError(f"{what}: expected numbers > 0, got {numbers.tolist()}")
    return tuple(numbers.tolist())


TABLE_1 = Parameters()
"""Table 1 of paper A: the LWR4+ with a tool of 0.43 m at 250 Hz. M_1 is in s/m and M_2..4 in s/rad."""

NEURO8 = Parameters(
    inertia=(8.0, 0.3, 0.3, 0.3),
    D_c=(150.0, 6.0, 6.0, 2.0),
    Q=(50.0, 2.0, 2.0, 1.0),
    M=(200.0, 40.0, 40.0, 40.0),
    G=(150.0, 6.0, 6.0, 2.0),
    C=(0.05, 20.0, 20.0, 20.0),
    redundant_inertia=0.01,
    redundant_damping=0.1,
    k=1e-3,
    d_0=0.003,
    d_0_angle=0.07,
    shaft_length=0.335,
    implicit_damping=True,
)
"""For the 8-dof neurosurgical arm in a workspace of centimetres, hands of at most 10 N; Table 1 is unusable there.

The wrist's two coordinates feel no hand force, and no region. A constraint on what they move does push them.
"""
