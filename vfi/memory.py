"""The blocks of the cycle's memory, by name."""

from enum import IntEnum


class Real(IntEnum):
    """Blocks of floats. n joints, d of them decided, f frames, e entities, m constraints, r = m + user rows."""

    PLACEMENT = 0
    FRAME_PLACEMENT = 1
    GEOMETRY = 2
    SIDE = 3
    SAFE = 4
    SETTINGS = 5
    WEIGHT = 6
    ETA = 7
    TOLERANCE = 8
    LIMITS = 9
    Q = 10
    QDOT = 11
    GIVEN = 12
    REFERENCE = 13
    TWIST = 14
    JOINT_POSE = 15
    POSE = 16
    JACOBIAN = 17
    DISTANCE = 18
    MARGIN = 19
    ROW = 20
    RESIDUAL = 21
    RATE = 22
    DEMAND = 23
    SLACK = 24
    TIP = 25
    ERROR = 26
    TASK = 27
    H = 28
    G = 29
    A = 30
    B = 31
    LOW = 32
    HIGH = 33
    V = 34
    CANDIDATE = 35
    LAST = 36
    MULTIPLIER = 37
    SCALE = 38
    WORK = 39
    Q_NEXT = 40
    JOINT_POSE_NEXT = 41
    POSE_NEXT = 42
    DISTANCE_NEXT = 43
    MARGIN_NEXT = 44
    DEFECT = 45
    RELAXED_H = 46
    RELAXED_G = 47
    RELAXED_A = 48
    RELAXED_B = 49
    RELAXED_LOW = 50
    RELAXED_HIGH = 51
    RELAXED_V = 52
    RELAXED_MULTIPLIER = 53
    RELAXED_WORK = 54
    RELAXED_SCALE = 55
    TARGET = 56
    LAST_DEFECT = 57
    SHORTFALL = 58
    POSE_JACOBIAN = 59
    CLOCK = 60
    """Time of the last measurement that was read, seconds."""


class Whole(IntEnum):
    """Blocks of integers."""

    PARENT = 0
    PRISMATIC = 1
    FRAME_JOINT = 2
    ADDRESS = 3
    FRAME = 4
    ENFORCED = 5
    SAFETY_CLASS = 6
    ANGULAR = 7
    STATUS = 8
    STATUS_NEXT = 9
    DECIDED = 10
    ACTIVE = 11
    MASK = 12
    RELAXED_ACTIVE = 13
    RELAXED_MASK = 14
    OPTIONS = 15
    OUTCOME = 16
