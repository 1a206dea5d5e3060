"""The blocks of the cycle's memory by name, and the regions' points: arrays of their own, which can be replaced."""

from enum import IntEnum, auto
from typing import Any

CLOUDS = "float64[:,::1], int64[::1], int64[::1], int64[::1], float64[::1], float64[::1], float64[:,::1]"
"""The regions' points likewise: points, order, start of all regions one after the other, and what a query fills:
index, place, distance, and for each point within sight its row of [d clearance / d v (4), clearance]."""


class _FromZero(IntEnum):
    @staticmethod
    def _generate_next_value_(name: str, start: int, count: int, last_values: list[Any]) -> int:
        return count


class Real(_FromZero):
    """Blocks of floats: n joints, d of them decided, m = d - 2 free coordinates, R regions; three frames."""

    PLACEMENT = auto()
    FRAME_PLACEMENT = auto()
    PORT = auto()
    SENSOR = auto()
    WEIGHT = auto()
    INERTIA = auto()
    DAMPING = auto()
    REDUNDANT = auto()
    LIMITS = auto()
    SETTINGS = auto()
    REGION = auto()
    REGION_POSE = auto()
    Q = auto()
    Q_TRIAL = auto()
    Q_LAST = auto()
    V = auto()
    V_REF = auto()
    V_NEXT = auto()
    COMMANDED = auto()
    QDOT = auto()
    RATE = auto()
    OFFSET = auto()
    WRENCH = auto()
    F_TH = auto()
    F_HAND = auto()
    F_R = auto()
    F_RX = auto()
    D = auto()
    STIFFNESS = auto()
    TOUCH = auto()
    SEGMENT = auto()
    AXIS = auto()
    FOUND = auto()
    LOCAL = auto()
    JOINT_POSE = auto()
    POSE = auto()
    JACOBIAN = auto()
    HANDLE = auto()
    HANDLE_LAST = auto()
    J = auto()
    GRAM = auto()
    FACTOR = auto()
    SCRATCH = auto()
    P = auto()
    X_C = auto()
    A_X = auto()
    A = auto()
    A_PLUS = auto()
    Z_X = auto()
    G = auto()
    G_LAST = auto()
    Z = auto()
    Z_PLUS_T = auto()
    Z_WORK = auto()
    Z_FACTOR = auto()
    A_LAST = auto()
    Z_PLUS_T_LAST = auto()
    SINGULAR = auto()
    SINGULAR_ROW = auto()
    METRIC = auto()
    METRIC_FACTOR = auto()
    LOW = auto()
    HIGH = auto()
    LIMIT_ROWS = auto()
    LIMIT_DEMAND = auto()
    LIMIT_COST = auto()
    LIMIT_GIVEN = auto()
    UNBOUNDED = auto()
    LIMIT_MULTIPLIER = auto()
    LIMIT_SCALE = auto()
    LIMIT_WORK = auto()
    TWIST = auto()
    J_RATE = auto()
    P_RATE = auto()
    Z_RATE = auto()
    A_X_RATE = auto()
    ACCELERATION = auto()
    DIRECTION = auto()
    EIGEN = auto()
    FREE = auto()
    FREE_RATE = auto()
    PORT_RATE = auto()
    STAGE = auto()
    LEDGER = auto()
    LEDGER_LAST = auto()
    PROGRESS = auto()


class Whole(_FromZero):
    """Blocks of integers."""

    PARENT = auto()
    PRISMATIC = auto()
    FRAME_JOINT = auto()
    DECIDED = auto()
    LIMIT_ACTIVE = auto()
    LIMIT_MASK = auto()
    REGION = auto()
    OPTIONS = auto()
    OUTCOME = auto()
