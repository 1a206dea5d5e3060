"""The loop of a real robot, 250 Hz: read, decide, verify that it is still true, send; with a driver that is not real.

The fake arm has what a real one has: a servo that lags, a state that arrives late or not at all, a command that gets
lost, and a watchdog of its own. Its clock is simulated, so that the example repeats to the bit.

Run it with ``python docs/examples/07_robot_loop.py``.
"""

from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from primitives import Constraint, ConstraintSet, Plane, Point, Robot
from vfi import Controller, Measurement, State, VelocityTask

PERIOD = 0.004  # s


class Reading(NamedTuple):
    """What the robot says: when it was measured (s), q and q̇ (rad, rad/s)."""

    stamp: float
    q: np.ndarray
    qdot: np.ndarray


class Driver(Protocol):
    """What the loop needs of a robot. Put your vendor's interface behind these five."""

    def clock(self) -> float:
        """Seconds, of the same clock as the stamps; it never goes back."""

    def wait(self, until: float) -> None:
        """Sleep until then."""

    def read(self) -> Reading:
        """The latest state; it does not block."""

    def send(self, qdot: np.ndarray) -> None:
        """Command velocities, rad/s."""

    def stop(self) -> None:
        """Brake to rest as the robot does it best. Must work whatever else is broken."""


class FakeArm:
    """Joints that lag by 5 ms; from 1.0 to 1.05 s no state arrives, and 1 in 50 commands is lost."""

    LAG, WATCHDOG = 0.005, 2.0 * PERIOD

    def __init__(self, q: np.ndarray):
        self.t, self.q, self.qdot, self.command = 0.0, q.copy(), np.zeros(len(q)), np.zeros(len(q))
        self.heard, self.stops, self.rng = 0.0, 0, np.random.default_rng(0)
        self.last = Reading(0.0, self.q.copy(), self.qdot.copy())

    def clock(self) -> float:
        """See `Driver`."""
        return self.t

    def wait(self, until: float) -> None:
        """See `Driver`."""
        while self.t < until - 1e-9:
            self.t += 0.001
            if self.t - self.heard > self.WATCHDOG:  # nobody speaks to me any more
                self.command = np.zeros(len(self.q))
            self.qdot = self.qdot + (1.0 - np.exp(-0.001 / self.LAG)) * (self.command - self.qdot)
            self.q = self.q + 0.001 * self.qdot
            if not 1.0 <= self.t <= 1.05:
                self.last = Reading(self.t, self.q.copy(), self.qdot.copy())

    def read(self) -> Reading:
        """See `Driver`."""
        return self.last

    def send(self, qdot: np.ndarray) -> None:
        """See `Driver`."""
        if self.rng.random() > 0.02:
            self.command, self.heard = qdot.copy(), self.t

    def stop(self) -> None:
        """See `Driver`."""
        self.command, self.stops = np.zeros(len(self.q)), self.stops + 1


class Loop:
    """One controller and one driver; `run` ends when the time is over or when somebody has to look."""

    def __init__(self, driver: Driver, controller: Controller):
        self.driver, self.controller = driver, controller
        self.late, self.held, self.margins = 0, 0, []

    def run(self, wanted: np.ndarray, until: float) -> None:
        """Follow joint velocities (rad/s) until a time (s), or until the controller stays in HOLD or FAULT."""
        deadline = self.driver.clock()
        while not self.controller.latched and self.driver.clock() < until:
            try:
                self._cycle(wanted)
            except BaseException:
                self.driver.stop()  # whatever goes wrong here, the robot does not go on
                raise
            deadline += PERIOD
            if self.driver.clock() > deadline:  # a cycle took too long: begin a new rhythm
                self.late, deadline = self.late + 1, self.driver.clock()
            self.driver.wait(deadline)
        self.driver.stop()

    def _cycle(self, wanted: np.ndarray) -> None:
        reading = self.driver.read()
        stamps = {"q": reading.stamp, "qdot": reading.stamp}
        measurement = Measurement(self.driver.clock(), reading.q, reading.qdot, stamps=stamps)
        command = self.controller.step(measurement, wanted)
        self.margins.append(command.margins["above table"])
        self.held += command.state == State.HOLD
        if not command.valid or self.driver.clock() >= command.expires:
            self.driver.stop()
        else:
            self.driver.send(command.qdot)  # verified; in HOLD it is rest, or the way to it


robot = Robot.from_urdf(Path(__file__).parent / "six_axis.urdf", tip="tool_tip")
tip = Point.at([0.0, 0.0, 0.0], frame="tool_tip")
table = Plane.through(point=[0.0, 0.0, 0.10], normal=[0.0, 0.0, 1.0])
above = ConstraintSet([Constraint("above table", tip, table, keep="outside", safe_distance=0.01)])
controller = Controller(robot, above, VelocityTask(), period=PERIOD, eta=5.0)
controller.step(Measurement(-PERIOD, np.zeros(robot.n), np.zeros(robot.n)), np.zeros(robot.n))  # the first one is slow

arm = FakeArm(np.array([0.0, 0.3, 0.9, 0.8, 0.0, 0.2]))
loop = Loop(arm, controller)
wanted = np.array([0.1, 0.3, 0.2, 0.0, 0.0, 0.0])  # rad/s; leads the tip through the table
while arm.clock() < 4.0:
    loop.run(wanted, until=4.0)
    if controller.latched:
        print(controller.latched)
        arm.wait(arm.clock() + 0.2)  # a person comes and looks
        controller.acknowledge()

height = robot.kinematics(arm.q).translation("tool_tip")[2]
print(
    f"cycles {len(loop.margins)}, held {loop.held}, late {loop.late}, smallest margin {min(loop.margins) * 1e3:.2f} mm"
)
print(f"tip height at the end {height * 1e3:.1f} mm, table and safe distance 110.0 mm")
