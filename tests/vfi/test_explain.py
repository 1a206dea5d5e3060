"""Reasons in words: every one has some, each names its place, with units."""

from typing import Any

import numpy as np
import pytest

from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Line
from tests.vfi.arms import START, pair, paper_constraints
from vfi.controller import Controller
from vfi.explain import conflict, explain, slacks
from vfi.memory import Real, Whole
from vfi.messages import Measurement
from vfi.outcome import Reason, Slot, State
from vfi.tasks import VelocityTask

CONE = Constraint(
    "cone", Line.z_axis("moving/frame6"), Line.through([0, 0, 0], [0, 0, -1]), "inside", 1.0, "line_line_angle"
)


@pytest.fixture
def controller() -> Controller:
    c = Controller(pair(), paper_constraints() + CONE, VelocityTask(), period=1e-3, group="moving", user_rows=2)
    assert c.step(Measurement(0.0, START, np.zeros(16)), np.zeros(8)).state == State.RUN
    return c


def said(c: Controller, reason: Reason, where: int = -1) -> str:
    c._outcome[Slot.REASON], c._outcome[Slot.WHERE] = reason, where
    return explain(c._memory, c.constraints.names, c.joints)


OF_THE_CONTROLLER = Reason.MEASUREMENT, Reason.STALE, Reason.LATCHED
"""Reasons whose words the controller has; `test_states` reads them."""


@pytest.mark.parametrize("reason", [r for r in Reason if r not in (Reason.NONE, *OF_THE_CONTROLLER)])
def test_every_reason_has_words(controller, reason):
    text = said(controller, reason, 0)
    assert len(text) > 20 and "\n" not in text


def test_no_reason_no_words(controller):
    assert said(controller, Reason.NONE) == ""


@pytest.mark.parametrize("where", range(7))
def test_place_that_is_not_kept(controller, where):
    label = ['"C1"', '"C2"', '"C3"', '"C4"', '"cone"', "row 0", "row 1"][where]
    assert label in said(controller, Reason.NOT_KEPT, where)


def test_joint_limit_that_is_not_kept(controller):
    assert said(controller, Reason.NOT_KEPT).startswith("a joint limit would not be kept")


@pytest.mark.parametrize(("where", "unit"), [(0, " m,"), (4, " rad,")])
def test_constraint_without_a_row_in_its_unit(controller, where, unit):
    text = said(controller, Reason.NO_ROW, where)
    assert ['"C1"', 0, 0, 0, '"cone"'][where] in text and unit in text


@pytest.mark.parametrize(("where", "value"), [(1, "0.003 m"), (4, "0.003 rad")])
def test_violation_that_is_being_left_in_its_unit(controller, where, value):
    controller._memory.real[Real.MARGIN][where] = -0.003
    assert f"is violated by {value} and" in said(controller, Reason.RECOVERING, where)


def test_joint_out_of_its_range(controller):
    controller._memory.real[Real.Q][4] = 0.4
    assert said(controller, Reason.OUT_OF_RANGE, 4).startswith(
        "moving/joint5 is at 0.4, outside its range from 0.15 to 0.32"
    )


@pytest.mark.parametrize(("block", "what"), [(Real.Q, "q"), (Real.QDOT, "qdot"), (Real.REFERENCE, "reference")])
def test_number_that_is_not_finite_is_shown(controller, block, what):
    controller._memory.real[block][2] = np.nan
    text = said(controller, Reason.NOT_FINITE)
    assert text.startswith(f"{what}: expected finite numbers, got [") and "nan" in text


def test_entity_that_is_not_finite(controller):
    assert said(controller, Reason.NOT_FINITE).startswith("an entity")


def test_conflict_in_names(controller):
    """Rows are numbered constraints, rows of the user, lower and upper limits of the decided joints."""
    active = controller._memory.whole[Whole.ACTIVE]
    active[:7] = [6, 1, 4, 6, 7, 7 + 8 + 7, 0]
    assert conflict(controller._memory, controller.constraints.names, controller.joints) == (
        "C2",
        "cone",
        "row 1",
        "lower limit of moving/joint1",
        "upper limit of moving/joint8",
        "C1",
    )
    text = said(controller, Reason.INFEASIBLE)
    assert "in conflict: C2, cone, row 1, lower limit of moving/joint1, upper limit of moving/joint8, C1;" in text
    active[0] = 0
    assert "in conflict: unknown" in said(controller, Reason.INFEASIBLE)


def test_slacks_in_names_and_units(controller):
    real: Any = controller._memory.real
    real[Real.V][:] = 0.0
    real[Real.DEMAND][:7] = [0.02, -0.01, 0.005, -np.inf, 0.3, 0.01, -np.inf]
    real[Real.SLACK][:7] = [0.02, 0.0, 0.0, 0.0, 0.3, 0.01, 0.0]
    real[Real.DEFECT][:] = -1.0
    expected = {"C1": 0.02, "cone": 0.3, "row 0": 0.01}
    assert slacks(controller._memory, controller.constraints.names) == pytest.approx(expected)
    assert said(controller, Reason.SLACK).endswith("C1 by 0.02 m/s, cone by 0.3 rad/s, row 0 by 0.01 m/s")


def test_slack_that_only_the_predicted_margin_needed(controller):
    """The row itself is kept; what the sample fell short of is what yielded."""
    real: Any = controller._memory.real
    real[Real.V][:], real[Real.DEMAND][:], real[Real.SLACK][:] = 0.0, -0.1, 0.0
    real[Real.SLACK][2], real[Real.DEFECT][:] = 0.004, 0.0
    assert slacks(controller._memory, controller.constraints.names) == pytest.approx({"C3": 0.004})


def test_nothing_measurable(controller):
    controller._memory.real[Real.SLACK][:] = 0.0
    assert said(controller, Reason.SLACK).endswith("none measurably")


def test_without_constraints():
    c = Controller(pair(), ConstraintSet(), VelocityTask(), period=1e-3)
    assert said(c, Reason.SLACK).endswith("none measurably") and "a joint limit" in said(c, Reason.NOT_KEPT)
