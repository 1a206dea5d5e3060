"""One file a pair: distance, its gradient, and the singular set. `primitives.registry` finds every file of this folder.

A kernel takes the world geometries a, b (8,) of two elements, ``[point, direction, length, 0]`` in metres, writes the
gradient (12,) of the distance with respect to ``[point_a, direction_a, point_b, direction_b]``, and returns the
distance and a status of `primitives.vectors`. It knows no robot: `primitives.evaluate` turns the gradient into a
Jacobian for what moves with the joints and into a residual for what moves by itself.
"""
