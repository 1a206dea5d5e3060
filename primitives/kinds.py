"""Kinds of constraints as people think of them; each is one `Constraint` with the pair and the side that it means.

The same names stand as ``kind`` in files. Whatever they do not offer is written as a `Constraint`.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from primitives.checks import number
from primitives.constraint import Constraint, Keep
from primitives.elements import Cloud, Element, Line, Plane, Point
from primitives.errors import InputError
from primitives.registry import pairs


def _between(name: str, what: Element, other: Element, keep: Keep, distance: float, more: Any) -> Constraint:
    """The constraint of two elements, in the order in which there is a pair of them."""
    known = pairs.names()
    if f"{what.kind}_{other.kind}" not in known and f"{other.kind}_{what.kind}" in known:
        what, other = other, what
    return Constraint(name, what, other, keep, distance, **more)


def forbidden_region(
    name: str, what: Element, around: Element, radius: float, *, tool_radius: float = 0.0, **more: Any
) -> Constraint:
    """Keep a part of the tool out of the sphere, cylinder or capsule around a point, a line or a segment.

    Parameters
    ----------
    what, around : the part of the tool; the point, line or segment in the middle of the region.
    radius, tool_radius : of the region, and of the tool around its part, metres.
    more : other arguments of `Constraint`; so everywhere below.
    """
    reach = number(radius, "radius", low=0.0) + number(tool_radius, "tool_radius", low=0.0)
    return _between(name, what, around, "outside", reach, more)


def stay_inside(
    name: str, what: Element, around: Element, radius: float, *, tool_radius: float = 0.0, **more: Any
) -> Constraint:
    """Keep a part of the tool, with what is around it, in the sphere or cylinder around a point or a line.

    Parameters
    ----------
    what, around : the part of the tool; the point or line in the middle of the region.

    Raises
    ------
    InputError : a tool wider than the region.
    """
    room = number(radius, "radius", low=0.0) - number(tool_radius, "tool_radius", low=0.0)
    if room < 0.0:
        raise InputError(f'constraint "{name}": a tool of radius {tool_radius:g} m has no room in {radius:g} m')
    return _between(name, what, around, "inside", room, more)


def keep_above(name: str, what: Point, plane: Plane, *, distance: float = 0.0, **more: Any) -> Constraint:
    """Keep a point on the side of a plane that its normal points to, a distance in metres away from it."""
    return Constraint(name, what, plane, "outside", distance, **more)


def keep_below(name: str, what: Point, plane: Plane, *, distance: float = 0.0, **more: Any) -> Constraint:
    """Keep a point on the other side: above the same plane with its normal turned around."""
    return Constraint(name, what, replace(plane, dual_quaternion=-plane.dual_quaternion), "outside", distance, **more)


def cone(name: str, axis: Line, around: Line, angle: float, **more: Any) -> Constraint:
    """Keep the direction of a line of the tool within an angle of that of another line.

    Parameters
    ----------
    axis, around : the line of the tool; the line, or in files the (3,) direction, in the middle of the cone.
    angle : from the middle to the cone, rad.
    """
    return Constraint(name, axis, around, "inside", angle, "line_line_angle", **more)


def rcm(name: str, shaft: Line, port: Point, tolerance: float, **more: Any) -> Constraint:
    """Keep a shaft's line within a tolerance of a port: paper V's entry sphere.

    Parameters
    ----------
    port : in files (3,), metres, world. tolerance : metres.
    """
    return Constraint(name, shaft, port, "inside", tolerance, **more)


def cloud(name: str, what: Element, cloud: str, *, tool_radius: float = 0.0, **more: Any) -> Constraint:
    """Keep a point or segment of the tool, with a radius around it, out of a point cloud.

    Parameters
    ----------
    cloud : its name, in scenes a part of the anatomy. tool_radius : metres.
    """
    return Constraint(name, what, Cloud.named(cloud), "outside", tool_radius, **more)


def origin_of(frame: str) -> Point:
    """The origin of a robot frame."""
    return Point.at(np.zeros(3), frame=frame)
