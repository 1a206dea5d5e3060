"""Why two peers do not command quite what we do: the program by hand, with what is theirs in it. Nobody times this."""

from types import MappingProxyType

import numpy as np
import pinocchio as pin

from primitives import dual_quaternion as dq
from tests.bench import problem
from tests.bench.contenders.by_hand import ByHand


class SquaredDistances(ByHand):
    """C1..C3 as DQ Robotics has them: bounds on the rate of the squared distance.

    These are so small in SI units that DAQP's own tolerance, 1e-6, would show.
    """

    settings = MappingProxyType({"primal_tol": 1e-12})

    def rows(self, shaft, J_shaft, tip, J_tip):
        A, margins = super().rows(shaft, J_shaft, tip, J_tip)
        for i, (side, safe) in enumerate([(1.0, problem.APART), (-1.0, problem.OPENING), (-1.0, problem.RADIUS)]):
            distance = safe + side * margins[i]
            A[i] *= 2.0 * distance
            margins[i] = side * (distance**2 - safe**2)
        return A, margins


class LogarithmOfThePose(ByHand):
    """The cost of pink and mink: half the body twist from the tip to its target."""

    def error(self, tip, J_tip):
        x = problem.REFERENCE[self.k]
        target = pin.SE3(dq.rotation_matrix(x), dq.translation(x))
        away = target.actInv(tip)
        R = tip.rotation.T
        body = np.vstack([R @ J_tip[:3], R @ J_tip[3:]])
        return 0.5 * pin.Jlog6(away) @ body, 0.5 * pin.log6(away).vector
