"""S5 of the VFI paper without a file: two tools, four constraints, four poses.

Run it with ``python docs/examples/02_s5_in_python.py``; it takes a second or two.
"""

import numpy as np

from primitives import Constraint, ConstraintSet, Line, Plane, Point
from scenarios.analysis.metrics import summary
from scenarios.run import run
from scenarios.scene_file import load_scene

shaft, parked = Line.z_axis("moving/shaft"), Line.z_axis("parked/shaft")
shaft_end = Point.at([0.0, 0.0, 0.0], frame="moving/shaft")
tip = Point.at([0.0, 0.0, 0.0], frame="moving/tip")
entry = Point.at([0.0, 0.0, 0.0])
axis = Line.through(point=[0.0, 0.0, 0.0], direction=[0.0, 0.0, 1.0])
floor = Plane.through(point=[0.0, 0.0, -0.080], normal=[0.0, 0.0, 1.0])  # m

constraints = ConstraintSet(
    [
        Constraint("C1", shaft, parked, keep="outside", safe_distance=0.005),  # m
        Constraint("C2", shaft, entry, keep="inside", safe_distance=0.014),  # m
        Constraint("C3", shaft_end, axis, keep="inside", safe_distance=0.014),  # m
        Constraint("C4", tip, floor, keep="outside", safe_distance=0.0),  # m
    ]
)

scene = load_scene("S5").with_changes(constraints=constraints)
trace = run(scene, period=0.008)  # s

result = summary(trace)
for name, margin in result["min_margin_m"].items():
    print(f"{name}: smallest margin {margin * 1e3:6.3f} mm")
print(f"violated: {result['violated']}, infeasible cycles: {result['infeasible_cycles']}")
print(f"largest pose error |vec8|: {np.linalg.norm(trace['error'], axis=1).max():.2e}")
