"""Pinocchio, NumPy and DAQP by hand: the program of S5 itself, with no framework in between."""

from types import MappingProxyType

import daqp
import numpy as np
import pinocchio as pin

from tests.bench import problem
from tests.bench.contender import Contender
from tests.bench.numpy_rows import constraint_rows

TIP, SHAFT = "moving/tip", "moving/shaft"
AXES = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


def _left(a):
    """(4, 4): the quaternion product a b is _left(a) b."""
    w, x, y, z = a
    return np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])


def _right(b):
    """(4, 4): the quaternion product a b is _right(b) a."""
    w, x, y, z = b
    return np.array([[w, -x, -y, -z], [x, w, z, -y], [y, -z, w, x], [z, y, -x, w]])


class ByHand(Contender):
    name = "Pinocchio, NumPy, DAQP"
    settings = MappingProxyType({})

    def __init__(self):
        super().__init__()
        self.model = problem.ALONE.model
        self.data = self.model.createData()
        self.shaft, self.tip = self.model.getFrameId(SHAFT), self.model.getFrameId(TIP)
        self.sense, self.nothing = np.zeros(12, dtype=np.int32), np.full(4, 1e30)

    def step(self):
        q, model, data = self.q, self.model, self.data
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        shaft, tip = data.oMf[self.shaft], data.oMf[self.tip]
        J_shaft = pin.getFrameJacobian(model, data, self.shaft, AXES)
        J_tip = pin.getFrameJacobian(model, data, self.tip, AXES)
        A, margins = self.rows(shaft, J_shaft, tip, J_tip)
        J, error = self.error(tip, J_tip)
        H, g = J.T @ J + problem.DAMPING * np.eye(8), problem.GAIN * (J.T @ error)

        high = np.minimum(problem.SPEED, problem.LIMIT_ETA * (problem.UPPER - q))
        low = np.maximum(-problem.SPEED, problem.LIMIT_ETA * (problem.LOWER - q))
        upper, lower = np.concatenate([high, self.nothing]), np.concatenate([low, -problem.ETA * margins])
        v, _, flag, _ = daqp.solve(H, g, A, upper, lower, self.sense, **self.settings)
        if flag != 1:
            raise RuntimeError(f"DAQP: {flag}")
        return v

    def rows(self, shaft, J_shaft, tip, J_tip):
        """C1..C4: rows (4, 8) and margins (4,)."""
        return constraint_rows(shaft.translation, shaft.rotation[:, 2], J_shaft, tip.translation, J_tip)

    def error(self, tip, J_tip):
        """vec8(x - x_d) and its Jacobian (8, 8)."""
        x, y, z, w = pin.Quaternion(tip.rotation).coeffs()
        r, t = np.array([w, x, y, z]), np.array([0.0, *tip.translation])
        x_d = problem.REFERENCE[self.k]
        if r @ x_d[:4] < 0.0:
            r = -r
        J_r = 0.5 * _right(r)[:, 1:] @ J_tip[3:]
        J = np.vstack([J_r, 0.5 * (_right(r)[:, 1:] @ J_tip[:3] + _left(t) @ J_r)])
        return J, np.concatenate([r, 0.5 * _left(t) @ r]) - x_d


CONTENDERS = (ByHand,)
