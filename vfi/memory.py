"""The blocks of the cycle's memory, by name, and their sizes."""

from enum import IntEnum
from typing import NamedTuple

from primitives.active_set import work_rows
from primitives.cloud_rows import WIDTH
from primitives.memory import Memory
from vfi.outcome import Blend, Option, Setting, Slot, Work


class Real(IntEnum):
    """Blocks of floats; see `lay_out` for their shapes."""

    PLACEMENT = 0
    FRAME_PLACEMENT = 1
    GEOMETRY = 2
    SIDE = 3
    SAFE = 4
    SETTINGS = 5
    WEIGHT = 6
    ETA = 7
    ROW_TOLERANCE = 8
    JOINT_TOLERANCE = 9
    LIMITS = 10
    Q = 11
    QDOT = 12
    GIVEN = 13
    REFERENCE = 14
    TWIST = 15
    JOINT_POSE = 16
    POSE = 17
    JACOBIAN = 18
    DISTANCE = 19
    MARGIN = 20
    ROW = 21
    RESIDUAL = 22
    RATE = 23
    DEMAND = 24
    SLACK = 25
    TIP = 26
    ERROR = 27
    TASK = 28
    TARGET = 29
    POSE_JACOBIAN = 30
    H = 31
    G = 32
    A = 33
    B = 34
    LOW = 35
    HIGH = 36
    V = 37
    CANDIDATE = 38
    LAST = 39
    MULTIPLIER = 40
    SCALE = 41
    WORK = 42
    Q_NEXT = 43
    JOINT_POSE_NEXT = 44
    POSE_NEXT = 45
    DISTANCE_NEXT = 46
    MARGIN_NEXT = 47
    DEFECT = 48
    LAST_DEFECT = 49
    SHORTFALL = 50
    RELAXED_H = 51
    RELAXED_G = 52
    RELAXED_A = 53
    RELAXED_B = 54
    RELAXED_LOW = 55
    RELAXED_HIGH = 56
    RELAXED_V = 57
    RELAXED_MULTIPLIER = 58
    RELAXED_SCALE = 59
    RELAXED_WORK = 60
    CLOCK = 61
    """Time of the last measurement that was read, seconds."""
    GAIN = 62
    """Of each pose task, 1/s."""
    FORCE = 63
    """How far a constraint is in force, from 0 to 1; see `vfi.blend`."""
    BLEND = 64
    SAFE_RATE = 65
    SPHERE = 66
    """Of constraints on clouds, as in `primitives.cloud_rows`."""
    CLOUD_PLACEMENT = 67
    POINTS = 68
    ALONG = 69
    APART = 70
    CONTACT = 71
    CLEARANCE = 72
    CLEARANCE_NEXT = 73
    PORT = 74
    """Of constraints that keep a port: x_c's Jacobian for all joints, and x_c; see `vfi.port`."""
    PORT_ERROR = 75
    PORT_WEIGHT = 76
    EQUALITY = 77
    """E v = e, rows that always hold, and what their elimination needs; see `vfi.basis`."""
    EQUALITY_RATE = 78
    ORTHOGONAL = 79
    TRIANGLE = 80
    BASIS = 81
    """v = basis y + offset."""
    OFFSET = 82
    METRIC = 83
    FREE = 84
    FREE_CANDIDATE = 85
    FREE_H = 86
    FREE_G = 87
    FREE_A = 88
    FREE_B = 89
    FREE_DEMAND = 90
    FREE_SLACK = 91
    FREE_WORK = 92
    UNBOUNDED = 93
    WORK_DONE = 94
    """See `vfi.outcome.Work`."""
    NOTED_MULTIPLIER = 95
    """As in the record: those of the points of a cloud as one."""
    NOTED_SLACK = 96
    JACOBIAN_NEXT = 97
    ROW_NEXT = 98
    RESIDUAL_NEXT = 99


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
    TIPS = 17
    FORM = 18
    """How each constraint becomes a part of the program; see `vfi.outcome.Form`."""
    CLOUD = 19
    CELLS = 20
    FOUND = 21
    OWNER = 22
    POINT = 23
    FREE_CLASS = 24
    CUT = 25
    """Of each cut the constraint that it belongs to; see `vfi.cuts`."""


class Sizes(NamedTuple):
    """What the memory of a controller is laid out for.

    Attributes
    ----------
    n, d : joints, and those decided. m, user : constraints, and rows of the user's.
    frames, robot_frames : all frames, entities among them, and those of the robot.
    reference, task, tips : numbers of a reference, rows of the task, pose tasks.
    free : variables of the program where it is solved in a basis, else 0. equalities : rows that always hold.
    clouds, points, cells, largest, contacts : as in `primitives.cloud_table.CloudTable`.
    cuts : the most that there can be; see `vfi.cuts`.
    """

    n: int
    d: int
    m: int
    user: int
    frames: int
    robot_frames: int
    reference: int
    task: int
    tips: int
    free: int
    equalities: int
    clouds: int
    points: int
    cells: int
    largest: int
    contacts: int
    cuts: int

    @property
    def fixed(self) -> int:
        """Rows that are there in every cycle: those of constraints, one each, and the user's."""
        return self.m + self.user

    @property
    def rows(self) -> int:
        """The most rows that there can be."""
        return self.fixed + self.contacts + self.cuts


def lay_out(s: Sizes) -> Memory:
    """A zeroed memory of these sizes."""
    n, d, m, free, rows = s.n, s.d, s.m, s.free, s.rows
    solved = rows + 2 * d if free else rows
    """Rows of the program as it is solved: bounds are rows of it where it is solved in a basis."""
    variables = free or d
    wide = variables + 1
    real = {
        Real.PLACEMENT: (n, 12),
        Real.FRAME_PLACEMENT: (s.robot_frames, 12),
        Real.GEOMETRY: (2 * m, 8),
        Real.SIDE: (m,),
        Real.SAFE: (m,),
        Real.SETTINGS: (len(Setting),),
        Real.WEIGHT: (s.task,),
        Real.ETA: (m,),
        Real.ROW_TOLERANCE: (rows,),
        Real.JOINT_TOLERANCE: (d,),
        Real.LIMITS: (4, d),
        Real.Q: (n,),
        Real.QDOT: (n,),
        Real.GIVEN: (n,),
        Real.REFERENCE: (s.reference,),
        Real.TWIST: (s.frames, 6),
        Real.JOINT_POSE: (n, 12),
        Real.POSE: (s.frames, 12),
        Real.JACOBIAN: (s.frames, 6, n),
        Real.DISTANCE: (m,),
        Real.MARGIN: (m,),
        Real.ROW: (m, n),
        Real.RESIDUAL: (m,),
        Real.RATE: (rows,),
        Real.DEMAND: (rows,),
        Real.SLACK: (rows,),
        Real.TIP: (8 * s.tips,),
        Real.ERROR: (8 * s.tips,),
        Real.TASK: (s.task, d),
        Real.TARGET: (s.task,),
        Real.POSE_JACOBIAN: (8, n),
        Real.H: (d, d),
        Real.G: (d,),
        Real.A: (rows, d),
        Real.B: (rows,),
        Real.LOW: (d,),
        Real.HIGH: (d,),
        Real.V: (d,),
        Real.CANDIDATE: (d,),
        Real.LAST: (d,),
        Real.MULTIPLIER: (solved + 2 * variables,),
        Real.SCALE: (solved,),
        Real.WORK: (work_rows(d), d),
        Real.Q_NEXT: (n,),
        Real.JOINT_POSE_NEXT: (n, 12),
        Real.POSE_NEXT: (s.frames, 12),
        Real.DISTANCE_NEXT: (m,),
        Real.MARGIN_NEXT: (m,),
        Real.DEFECT: (rows,),
        Real.LAST_DEFECT: (rows,),
        Real.SHORTFALL: (1,),
        Real.RELAXED_H: (wide, wide),
        Real.RELAXED_G: (wide,),
        Real.RELAXED_A: (solved, wide),
        Real.RELAXED_B: (solved,),
        Real.RELAXED_LOW: (wide,),
        Real.RELAXED_HIGH: (wide,),
        Real.RELAXED_V: (wide,),
        Real.RELAXED_MULTIPLIER: (solved + 2 * wide,),
        Real.RELAXED_SCALE: (solved,),
        Real.RELAXED_WORK: (work_rows(wide), wide),
        Real.CLOCK: (1,),
        Real.GAIN: (s.tips,),
        Real.FORCE: (m,),
        Real.BLEND: (m, len(Blend)),
        Real.SAFE_RATE: (m,),
        Real.SPHERE: (s.clouds, 6),
        Real.CLOUD_PLACEMENT: (s.clouds, 12),
        Real.POINTS: (s.points, 3),
        Real.ALONG: (s.largest,),
        Real.APART: (s.largest,),
        Real.CONTACT: (s.contacts, WIDTH),
        Real.CLEARANCE: (s.contacts,),
        Real.CLEARANCE_NEXT: (s.contacts,),
        Real.PORT: (2 * m, n),
        Real.PORT_ERROR: (2 * m,),
        Real.PORT_WEIGHT: (m,),
        Real.EQUALITY: (s.equalities, d),
        Real.EQUALITY_RATE: (s.equalities,),
        Real.ORTHOGONAL: (d, d) if free else (0, 0),
        Real.TRIANGLE: (d, s.equalities),
        Real.BASIS: (d, free),
        Real.OFFSET: (d,),
        Real.METRIC: (free, free),
        Real.FREE: (free,),
        Real.FREE_CANDIDATE: (free,),
        Real.FREE_H: (free, free),
        Real.FREE_G: (free,),
        Real.FREE_A: (solved, free),
        Real.FREE_B: (solved if free else 0,),
        Real.FREE_DEMAND: (solved if free else 0,),
        Real.FREE_SLACK: (solved if free else 0,),
        Real.FREE_WORK: (work_rows(free), free),
        Real.UNBOUNDED: (2 * free,),
        Real.WORK_DONE: (len(Work),),
        Real.NOTED_MULTIPLIER: (s.fixed + 2 * d,),
        Real.NOTED_SLACK: (s.fixed,),
        Real.JACOBIAN_NEXT: (s.frames, 6, n),
        Real.ROW_NEXT: (m, n),
        Real.RESIDUAL_NEXT: (m,),
    }
    whole = {
        Whole.PARENT: (n,),
        Whole.PRISMATIC: (n,),
        Whole.FRAME_JOINT: (s.robot_frames,),
        Whole.ADDRESS: (m,),
        Whole.FRAME: (m, 2),
        Whole.ENFORCED: (m,),
        Whole.SAFETY_CLASS: (rows,),
        Whole.ANGULAR: (m,),
        Whole.STATUS: (m,),
        Whole.STATUS_NEXT: (m,),
        Whole.DECIDED: (d,),
        Whole.ACTIVE: (d + 2,),
        Whole.MASK: (solved + 2 * variables,),
        Whole.RELAXED_ACTIVE: (wide + 2,),
        Whole.RELAXED_MASK: (solved + 2 * wide,),
        Whole.OPTIONS: (len(Option),),
        Whole.OUTCOME: (len(Slot),),
        Whole.TIPS: (s.tips,),
        Whole.FORM: (m,),
        Whole.CLOUD: (s.clouds, 8),
        Whole.CELLS: (s.cells,),
        Whole.FOUND: (s.largest,),
        Whole.OWNER: (s.contacts,),
        Whole.POINT: (s.contacts,),
        Whole.FREE_CLASS: (solved if free else 0,),
        Whole.CUT: (s.cuts,),
    }
    return Memory(real, whole)
