"""A solver of one's own for the program of a cycle: coordinate ascent on the multipliers (C. Hildreth, 1957).

A back end is bound once to the views of a controller's program and is then asked once a cycle. Nothing that it answers
is trusted: the controller verifies it like the answer of its own kernel.

Run it with ``python docs/examples/05_own_solver.py``.
"""

import numpy as np

from primitives import Constraint, ConstraintSet, Plane, Point
from scenarios.robots import robots
from vfi import QP, Controller, Measurement, Solver, SolverStatus, VelocityTask
from vfi.backends import solvers

SWEEPS, ENOUGH = 2000, 1e-13


class Hildreth:
    """min 1/2 v'Hv + g'v subject to A v >= b and low <= v <= high, one multiplier after the other."""

    def __init__(self, qp: QP):
        self.qp = qp  # views: their contents are new in every cycle

    def solve(self, v: np.ndarray, multiplier: np.ndarray) -> SolverStatus:
        """Fill v (n,) and the multipliers (m + 2n,) of rows, lower and upper bounds."""
        qp, n = self.qp, len(v)
        G = np.vstack([qp.A, np.eye(n), -np.eye(n)])
        h = np.concatenate([qp.b, qp.low, -qp.high])
        used = np.flatnonzero(h > -np.inf)  # rows that are not in force demand -inf
        inverse = np.linalg.inv(qp.H)
        G, h = G[used], h[used]
        gram, start = G @ inverse @ G.T, -G @ inverse @ qp.g
        lagrange = np.zeros(len(used))
        for _ in range(SWEEPS):
            change = 0.0
            for i in range(len(used)):
                if gram[i, i] > 0.0:
                    better = max(0.0, lagrange[i] + (h[i] - start[i] - gram[i] @ lagrange) / gram[i, i])
                    change = max(change, abs(better - lagrange[i]))
                    lagrange[i] = better
            if change <= ENOUGH * max(1.0, lagrange.max(initial=0.0)):
                v[:] = inverse @ (G.T @ lagrange - qp.g)
                multiplier[:] = 0.0
                multiplier[used] = lagrange
                return SolverStatus.OPTIMAL
        return SolverStatus.NOT_CONVERGED  # the controller then asks its kernel, and says so


solvers.register(Solver("hildreth", "coordinate ascent on the multipliers", Hildreth))

robot = robots["neuro8"].build()
tip = Point.at([0.0, 0.0, 0.0], frame="tip")
floor = Plane.through(point=[0.0, 0.0, -0.36], normal=[0.0, 0.0, 1.0])
limits = ConstraintSet([Constraint("floor", tip, floor, keep="outside", safe_distance=0.002)])
wanted = np.array([0.0, 0.0, 0.1, 0.1, 0.05, 0.0, 0.3, -0.3])  # rad/s and m/s; leads the tip through the floor

farthest, slowest, states = 0.0, 0.0, set()
own, kernel = (
    Controller(robot, limits, VelocityTask(), period=0.004, eta=5.0, solver=name) for name in ("hildreth", "active-set")
)
q, qdot = np.array([0.0, 0.0, 0.0, 0.0, 0.25, 0.0, 0.1, 0.1]), np.zeros(8)
for k in range(500):
    measurement = Measurement(k * 0.004, q, qdot)
    command, twin = own.step(measurement, wanted), kernel.step(measurement, wanted)
    farthest = max(farthest, np.abs(command.qdot - twin.qdot).max())
    states.add(command.state.name)
    slowest = max(slowest, command.multipliers["floor"])
    qdot = command.qdot
    q = q + 0.004 * qdot

print(f"states: {', '.join(sorted(states))}; margin at the end {command.margins['floor'] * 1e3:.3f} mm")
print(f"largest multiplier of the floor {slowest:.3f}, largest difference from the kernel {farthest:.1e}")
