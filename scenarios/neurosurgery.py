"""S1-S5 of paper V in Python: the same scenes as the files of `scenarios.scenes`, equal to the bit.

The paper gives neither the arm's parameters nor its poses; these were designed to give its pattern of violations. The
entry point is the world's origin, z points up.
"""

from primitives.checks import known
from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Line, Plane, Point
from scenarios.enforcement import Enforcement
from scenarios.scene import Scene
from scenarios.trajectory import PoseTrajectory, Waypoint
from vfi.tasks import PoseTask

MOVING = (-0.011, -0.0016666666666666668, -0.11065722117389565, 0.0, 0.24675386270768487, 0.0, 0.15, 0.1)
"""First configuration of the moving arm, m and rad: its shaft runs through (-5, -11, 0) mm to (0, -11, -45) mm."""

PARKED = (0.002, -0.0036451612903225807, 0.08047101126546087, 0.0, 0.26298045839389445, 0.0, 0.15, -0.1)
"""Configuration of the parked arm, m and rad: its shaft runs through (7, 2, 0) mm to (2, 2, -62) mm."""

ORIGIN = (0.0, 0.0, 0.0)
UP = (0.0, 0.0, 1.0)

CONSTRAINTS = ConstraintSet(
    [
        Constraint("C1", Line.z_axis("moving/shaft"), Line.z_axis("parked/shaft"), "outside", 0.005),
        Constraint("C2", Line.z_axis("moving/shaft"), Point.at(ORIGIN), "inside", 0.014),
        Constraint("C3", Point.at(ORIGIN, frame="moving/shaft"), Line.through(ORIGIN, UP), "inside", 0.014),
        Constraint("C4", Point.at(ORIGIN, frame="moving/tip"), Plane.through((0.0, 0.0, -0.08), UP), "outside", 0.0),
    ]
)
"""The shafts stay 5 mm apart (C1), the moving one passes within 14 mm of the entry point (C2), its end stays within
14 mm of the z axis (C3), and the tip above z = -80 mm (C4)."""

REFERENCE = PoseTrajectory(
    (
        Waypoint((0.002931, -0.008618, -0.060532)),
        Waypoint((0.002931, 0.002682, -0.065532), (0.0, 0.0, 0.25)),
        Waypoint((0.002931, -0.015418, -0.068532), (0.1, 0.0, 0.25)),
        Waypoint((0.002931, -0.015418, -0.084), (0.1, 0.0, 0.0)),
    ),
    segment=4.0,
)
"""Four poses of the tip, metres and radians, 4 s from one to the next, then 3 s of hold."""

WRIST = (-0.17, 0.17)
"""Range of joints 7 and 8 in S3-stiff-wrist, rad."""

_ENFORCED: dict[str, tuple[str, ...]] = {
    "S1": (),
    "S2": ("C1",),
    "S3": ("C1", "C2"),
    "S4": ("C1", "C2", "C3"),
    "S5": ("C1", "C2", "C3", "C4"),
    "S3-stiff-wrist": ("C1", "C2"),
}
_SUMMARIES = {
    "S1": "four poses without any constraint enforced, all four watched",
    "S2": "as S1, the two shafts kept apart (C1)",
    "S3": "as S2, the shaft kept near the entry point (C2)",
    "S4": "as S3, the shaft's end kept in the cylindrical workspace (C3)",
    "S5": "as S4, the tip kept above the plane (C4)",
    "S3-stiff-wrist": "as S3, the wrist limited to +-0.17 rad; the linear program chatters here",
}


def scene(name: str) -> Scene:
    """One of S1, S2, S3, S4, S5 and S3-stiff-wrist; raises UnknownNameError."""
    known("neurosurgery scene", name, _ENFORCED)
    return Scene(
        name=name,
        summary=_SUMMARIES[name],
        robot="neuro8-pair",
        group="moving",
        start=MOVING + PARKED,
        constraints=CONSTRAINTS.enforcing(_ENFORCED[name]),
        task=PoseTask("moving/tip", gain=50.0, damping=1e-3),
        reference=REFERENCE,
        period=0.008,
        duration=15.0,
        enforcement=Enforcement(eta=0.5, limit_eta=5.0),
        limits={f"moving/joint{i}": WRIST for i in (7, 8)} if name == "S3-stiff-wrist" else {},
    )
