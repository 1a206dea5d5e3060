"""The figures of merit that a comparison shows, and which of two values is the better one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from scenarios.analysis.kinds import BY_HAND, HANDS_ON
from scenarios.analysis.metrics import VIOLATED

Side = Literal["low", "high", ""]
DEGREES = 57.29577951308232


@dataclass(frozen=True)
class Measure:
    """A figure of merit.

    Attributes
    ----------
    key : in the summary of a run; dots lead into nested ones. label, unit : as shown. scale : from SI to that unit.
    better : "low", "high", or "" where neither is better by itself.
    effort : whether it says something of the hand's effort, which a tool that slipped off did not have.
    worst : which of several runs counts, the one with the lowest or the highest value; "" for the median.
    alarm : value below which it alarms, SI; None for never.
    path : the keys that lead to it, where one of them may hold a dot itself.
    """

    key: str
    label: str
    unit: str
    scale: float = 1.0
    better: Side = "low"
    effort: bool = False
    worst: Side = ""
    alarm: float | None = None
    path: tuple[str, ...] = ()

    def of(self, result: Mapping[str, Any]) -> float | None:
        """The value of a run in SI units; None where it has none."""
        value: Any = result
        for name in self.path or self.key.split("."):
            value = value[name]
        return None if value is None else float(value)


CLEARANCE = Measure("clearance_m.between_samples", "smallest clearance", "mm", 1e3, "", worst="low", alarm=0.0)
_PENETRATION = Measure("penetration_depth_m", "penetration", "mm", 1e3)
_INSIDE = Measure("time_inside_s", "time inside", "s")
EXCESS = Measure("passivity_excess_J", "passivity excess", "J", worst="high")
_HAND = (
    Measure("hand_work_J", "work of the hand", "J", effort=True),
    Measure("mean_force_N", "hand force, mean", "N", effort=True),
    Measure("max_force_N", "hand force, peak", "N", effort=True),
)
_CYCLES = (
    Measure("guard_interventions", "guard interventions", "cycles"),
    Measure("cycle_us.median", "cycle time, median", "µs", better=""),
    Measure("cycle_us.p99", "cycle time, p99", "µs", better=""),
)
OF_HANDS_ON = (
    CLEARANCE,
    _PENETRATION,
    _INSIDE,
    Measure("port_error_m.max", "port error, max", "µm", 1e6, worst="high"),
    EXCESS,
    Measure("felt_clearance_m", "felt from", "mm", 1e3, ""),
    *_HAND,
    Measure("max_boundary_force_N", "boundary force, peak", "N", effort=True),
    Measure("jerk_m_s3.rms", "jerk, rms", "m/s³", effort=True),
    Measure("jerk_m_s3.max", "jerk, peak", "m/s³", effort=True),
    Measure("tangential_freedom", "tangential freedom", "%", 100.0, "high", effort=True),
    Measure("travel_m", "way of the tool", "mm", 1e3, "", effort=True),
    *_CYCLES,
)
"""A larger clearance is no merit once it is positive, nor is a boundary felt from farther off; cycle times depend on
what else the machine did."""
ERROR = Measure("position_error_m.rms", "off the reference, rms", "mm", 1e3)
_ERRORS = (
    ERROR,
    Measure("position_error_m.max", "off the reference, max", "mm", 1e3),
    Measure("orientation_error_rad.rms", "turned from it, rms", "deg", DEGREES),
    Measure("orientation_error_rad.max", "turned from it, max", "deg", DEGREES),
)
_MOTION = (
    Measure("acceleration_rms", "joint acceleration, rms", "rad/s², m/s²"),
    Measure("infeasible_cycles", "program without solution", "cycles"),
    Measure("degraded_cycles", "DEGRADED", "cycles"),
    Measure("stopped_cycles", "HOLD or FAULT", "cycles"),
    *_CYCLES,
)
_LED = (
    EXCESS,
    *_HAND,
    Measure("mean_torque_Nm", "hand torque, mean", "Nm", effort=True),
    Measure("max_torque_Nm", "hand torque, peak", "Nm", effort=True),
    Measure("constraint_work_J", "work of the constraints", "J", better=""),
)


def constraint_measures(results: Sequence[Mapping[str, Any]]) -> tuple[Measure, ...]:
    """Smallest margin of every declared constraint, at and between cycles where both are known."""
    first, out = results[0], []
    for unit, shown, scale in (("m", "mm", 1e3), ("rad", "deg", DEGREES)):
        between = f"min_margin_between_{unit}"
        key = between if between in first else f"min_margin_{unit}"
        for name in first[key]:
            keep = name in first["to_keep"]
            label = f"margin of {name}" if keep else f"margin of {name}, watched"
            alarm = VIOLATED if keep else None
            path = (key, name)
            out.append(Measure(f"{key}.{name}", label, shown, scale, "", worst="low", alarm=alarm, path=path))
    return tuple(out)


def _of_tools(results: Sequence[Mapping[str, Any]]) -> tuple[Measure, ...]:
    """Of several tools, how far each is from its reference."""
    return tuple(
        Measure(
            f"tip_distance_m.{frame}.{part}",
            f"{frame} off its reference, {part}",
            "mm",
            1e3,
            path=("tip_distance_m", frame, part),
        )
        for frame in results[0]["tip_distance_m"]
        for part in ("rms", "max")
    )


def measures(results: Sequence[Mapping[str, Any]]) -> tuple[Measure, ...]:
    """Those of the kind of scene that the results are of, in the order in which they are shown."""
    first = results[0]
    if first["kind"] == HANDS_ON:
        return OF_HANDS_ON
    where = "between_samples" if first["clearance_m"]["between_samples"] is not None else "at_samples"
    least = replace(CLEARANCE, key=f"clearance_m.{where}", label="smallest margin to keep", alarm=VIOLATED)
    errors = _of_tools(results) if "tip_distance_m" in first else _ERRORS
    return (
        least,
        _PENETRATION,
        _INSIDE,
        *constraint_measures(results),
        *errors,
        *(_LED if first["kind"] == BY_HAND else ()),
        *_MOTION,
    )
