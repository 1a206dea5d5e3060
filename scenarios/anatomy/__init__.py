"""Anatomy for the hands-on scenes: procedural shapes whose distances are known exactly, and placement under a port."""

from scenarios.anatomy.bowl import Bowl
from scenarios.anatomy.ellipsoid import Ellipsoid
from scenarios.anatomy.placement import placed_under, under_port
from scenarios.anatomy.scenes import Anatomy, bowl_for, cortex, kidney
from scenarios.anatomy.shape import Shape
from scenarios.anatomy.vessels import Branch, Vessels

__all__ = [
    "Anatomy",
    "Bowl",
    "Branch",
    "Ellipsoid",
    "Shape",
    "Vessels",
    "bowl_for",
    "cortex",
    "kidney",
    "placed_under",
    "under_port",
]
