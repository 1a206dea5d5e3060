"""A primitive of one's own: the distance from a point to a circle, e.g. the rim of a trocar.

A kernel takes two geometries in the world, ``[point (3), direction (3), length, 0]`` in metres, writes the gradient
with respect to ``[point_a, direction_a, point_b, direction_b]`` and returns the distance and a status. Everything
else (Jacobians, residuals, rows, verification) follows from it.

Run it with ``python docs/examples/03_own_primitive.py``.
"""

import numpy as np

from primitives import PAIR_SIGNATURE, Constraint, ConstraintSet, Line, Pair, Point
from primitives.compiled import compiled
from primitives.evaluate import evaluate
from primitives.registry import pairs
from primitives.vectors import DEGENERATE, OK
from scenarios.robots import robots

RIM = 0.010  # m, radius of the circle around b.point, in the plane perpendicular to b.direction


@compiled(PAIR_SIGNATURE)
def point_rim(a, b, gradient):
    """d = |p - c|, c the nearest point of the circle."""
    gradient[:] = 0.0
    height = 0.0
    for i in range(3):
        height += (a[i] - b[i]) * b[3 + i]
    radial = np.empty(3)
    radius = 0.0
    for i in range(3):
        radial[i] = a[i] - b[i] - height * b[3 + i]
        radius += radial[i] * radial[i]
    radius = np.sqrt(radius)
    distance = np.sqrt((radius - RIM) ** 2 + height**2)
    if radius < 1e-9 or distance < 1e-9:
        return distance, DEGENERATE
    for i in range(3):
        along = (radius - RIM) / distance * radial[i] / radius + height / distance * b[3 + i]
        gradient[i] = along
        gradient[6 + i] = -along
        # height' = n' . (p - c), and the radial length changes by -height n' . radial / radius
        gradient[9 + i] = height / distance * radial[i] - (radius - RIM) / distance * height * radial[i] / radius
    return distance, OK


pairs.register(Pair("point_rim", "point", "line", "m", point_rim))

robot = robots["neuro8"].build()
tip = Point.at([0.0, 0.0, 0.0], frame="tip")
trocar = Line.through(point=[0.05, 0.04, 0.0], direction=[0.0, 0.0, 1.0])
rim = ConstraintSet([Constraint("rim", tip, trocar, keep="outside", safe_distance=0.002, pair="point_rim")])

q = np.array([0.0, 0.0, 0.1, -0.1, 0.25, 0.2, 0.1, 0.1])  # m, m, rad, rad, m, rad, rad, rad
found = evaluate(robot, rim, q)
step = 1e-6
numeric = np.array(
    [
        (evaluate(robot, rim, q + e).margin[0] - evaluate(robot, rim, q - e).margin[0]) / (2.0 * step)
        for e in step * np.eye(robot.n)
    ]
)
print(f"distance to the rim: {found.distance[0] * 1e3:.3f} mm, margin {found.margin[0] * 1e3:.3f} mm")
print(f"largest difference of the Jacobian from central differences: {np.abs(found.jacobian[0] - numeric).max():.1e}")
