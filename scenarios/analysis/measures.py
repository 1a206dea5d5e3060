"""The figures of merit that a comparison shows, and which of two values is the better one."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal


@dataclass(frozen=True)
class Measure:
    """A figure of merit.

    Attributes
    ----------
    key : in the summary of a run; dots lead into nested ones. label, unit : as shown. scale : from SI to that unit.
    better : "low", "high", or "" where neither is better by itself.
    effort : whether it says something of the hand's effort, which a tool that slipped off did not have.
    """

    key: str
    label: str
    unit: str
    scale: float = 1.0
    better: Literal["low", "high", ""] = "low"
    effort: bool = False

    def of(self, result: Mapping[str, Any]) -> float | None:
        """The value of a run in SI units; None where it has none."""
        value: Any = result
        for name in self.key.split("."):
            value = value[name]
        return None if value is None else float(value)


MEASURES = (
    Measure("clearance_m.between_samples", "smallest clearance", "mm", 1e3, ""),
    Measure("penetration_depth_m", "penetration", "mm", 1e3),
    Measure("time_inside_s", "time inside", "s"),
    Measure("port_error_m.max", "port error, max", "µm", 1e6),
    Measure("passivity_excess_J", "passivity excess", "J"),
    Measure("felt_clearance_m", "felt from", "mm", 1e3, ""),
    Measure("hand_work_J", "work of the hand", "J", effort=True),
    Measure("mean_force_N", "hand force, mean", "N", effort=True),
    Measure("max_force_N", "hand force, peak", "N", effort=True),
    Measure("max_boundary_force_N", "boundary force, peak", "N", effort=True),
    Measure("jerk_m_s3.rms", "jerk, rms", "m/s³", effort=True),
    Measure("jerk_m_s3.max", "jerk, peak", "m/s³", effort=True),
    Measure("tangential_freedom", "tangential freedom", "%", 100.0, "high", effort=True),
    Measure("travel_m", "way of the tool", "mm", 1e3, "", effort=True),
    Measure("guard_interventions", "guard interventions", "cycles"),
    Measure("cycle_us.median", "cycle time, median", "µs", better=""),
    Measure("cycle_us.p99", "cycle time, p99", "µs", better=""),
)
"""Of hands-on runs. A larger clearance is no merit once it is positive, nor is a boundary felt from farther off; cycle
times depend on what else the machine did."""
