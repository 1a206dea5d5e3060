"""Who decides where several arms of one robot share a workspace.

"central": one program decides the joints of all arms; it is a plain `vfi.controller.Controller`. "static" and
"velocity": each arm has a controller of its own, which knows where the others are; under "static" it takes them to
stand still, under "velocity" it knows how fast they move, from the measurement, hence one period late.

A constraint between two arms is then a row of both controllers, one that moves one arm only is a row of that one's.
Each controller verifies its own command, with the other arms as it believes them to move. Nobody verifies both
together: in a system of separate controllers both commands are known nowhere before the arms execute them. What came
of them is the margin of the next cycle, and `scenarios.analysis.between` looks at the way there.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from primitives.checks import Array, array
from primitives.constraint import ConstraintSet
from primitives.robot import Robot
from primitives.table import check_influence, influences, used_frames
from vfi.controller import Controller
from vfi.messages import Command, Layout, Measurement

_SIDE_BY_SIDE = ("qdot", "reference", "pose", "error")
"""Quantities of a record that every arm has its own of."""
_LARGEST = ("infeasible", "resolves", "halvings", "intervened", "shortfall", "slack")
"""Quantities of which the joint record holds the larger one."""
_OF_THE_GRAVEST = ("state", "reason", "where", "solver")
"""Quantities that the joint record takes from the arm in the graver state."""


def constraints_of(robot: Robot, constraints: ConstraintSet, group: str) -> ConstraintSet:
    """The same constraints, of which only those stay enforced that a joint of the group can influence."""
    frames = used_frames(constraints)
    flat, decided = robot.flat(frames), robot.group(group)
    return ConstraintSet(replace(c, enforced=c.enforced and influences(c, frames, flat, decided)) for c in constraints)


class SeparateControllers:
    """One controller an arm, each given the same measurement in each cycle; used like a `Controller` of all of them.

    Parameters
    ----------
    robot, constraints : of all arms. group : all joints that are decided. arms : their joint groups.
    know_velocity : False where each takes the others to stand still.
    make : makes the controller of an arm, from its constraints, the arm's place among them and its joint group.
    ring : records kept until they are drained.

    Raises
    ------
    InactiveConstraintError : an enforced constraint that no arm can influence. Others as `Controller`.
    """

    def __init__(
        self,
        robot: Robot,
        constraints: ConstraintSet,
        group: str,
        arms: tuple[str, ...],
        know_velocity: bool,
        make: Callable[[ConstraintSet, int, str], Controller],
        ring: int = 512,
    ):
        frames, decided = used_frames(constraints), robot.group(group)
        check_influence(constraints, frames, robot.flat(frames), decided)
        self.parts = tuple(make(constraints_of(robot, constraints, arm), i, arm) for i, arm in enumerate(arms))
        """The controllers, in the order of the arms."""
        self.robot, self.constraints, self.cycles = robot, constraints, 0
        first = self.parts[0]
        self.period, self.solver, self.guard = first.period, first.solver, first.guard
        self.joints = tuple(robot.joints[i] for i in decided)
        self._places = [np.array([list(decided).index(i) for i in robot.group(arm)]) for arm in arms]
        self._others = [np.setdiff1d(decided, robot.group(arm)) for arm in arms]
        self._know_velocity, self._rows = know_velocity, len(constraints)
        self.columns = self._joint_columns()
        self.ring: Array = np.zeros((ring, max(place.stop for place in self.columns.values())))
        self._layout = Layout.of(self.columns, constraints.names)

    def step(self, measurement: Measurement, reference: Array) -> Command:
        """One cycle of every controller; the command of all joints, in the state of the graver arm.

        Parameters
        ----------
        measurement : see `vfi.messages.Measurement`. reference : (8 arms,) poses, one after the other.
        """
        wanted = array(reference, (8 * len(self.parts),), "reference", finite=False).reshape(-1, 8)
        commands = []
        for part, others, pose in zip(self.parts, self._others, wanted, strict=True):
            seen = measurement
            if not self._know_velocity:
                qdot = measurement.qdot.copy()
                qdot[others] = 0.0
                seen = measurement._replace(qdot=qdot)
            commands.append(part.step(seen, pose))
        row = self.ring[self.cycles % len(self.ring)]
        self._join([self._with_time(part, c.record) for part, c in zip(self.parts, commands, strict=True)], row)
        self.cycles += 1
        words = [f"{part.group}: {c.reason}" for part, c in zip(self.parts, commands, strict=True) if c.reason]
        state = max(c.state for c in commands)
        return Command(row.copy(), self._layout, state, "; ".join(words), min(c.expires for c in commands))

    @staticmethod
    def _with_time(part: Controller, record: Array) -> Array:
        """The record with the time that the cycle took, which the controller knows once the record is copied."""
        place = part.columns["cycle_us"]
        record[place] = part.ring[(part.cycles - 1) % len(part.ring), place]
        return record

    def _joint_columns(self) -> dict[str, slice]:
        """Those of one controller of all arms: a trace looks the same however the arms are coordinated."""
        out, at = {}, 0
        for name, place in self.parts[0].columns.items():
            size = place.stop - place.start
            if name in _SIDE_BY_SIDE:
                size = sum(part.columns[name].stop - part.columns[name].start for part in self.parts)
            elif name == "multiplier":
                size = self._rows + 2 * len(self.joints)
            out[name] = slice(at, at + size)
            at += size
        return out

    def _join(self, records: list[Array], out: Array) -> None:
        """Write the joint record of a cycle."""
        columns, joint = self.parts[0].columns, self.columns
        gravest = max(records, key=lambda record: float(record[columns["state"]][0]))
        for name, place in columns.items():
            values = [record[part.columns[name]] for record, part in zip(records, self.parts, strict=True)]
            view = out[joint[name]]
            if name == "qdot":
                for own, value in zip(self._places, values, strict=True):
                    view[own] = value
            elif name in _SIDE_BY_SIDE:
                view[:] = np.concatenate(values)
            elif name == "multiplier":
                self._join_multipliers(values, view)
            elif name in _LARGEST:
                view[:] = np.max(values, axis=0)
            elif name == "cycle_us":
                view[:] = np.sum(values, axis=0)
            else:
                view[:] = gravest[place] if name in _OF_THE_GRAVEST else values[0]

    def _join_multipliers(self, values: list[Array], view: Array) -> None:
        """Of rows the larger; those of the joints' bounds, lower and upper, at their joints."""
        m, d = self._rows, len(self.joints)
        view[:m] = np.max([value[:m] for value in values], axis=0)
        for own, value in zip(self._places, values, strict=True):
            view[m + own], view[m + d + own] = np.split(value[m:], 2)
