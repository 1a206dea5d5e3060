"""A plant by its name: which of them a scene runs on."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from primitives.checks import Array, known
from primitives.point_cloud import PointCloud
from scenarios.own_robot import SceneRobot, entry_of
from scenarios.plants import PLANTS, Plant
from scenarios.plants.kinematic import KinematicPlant

TOUCHED = 1.0 / np.sqrt(3.0)
"""Radius of a sphere that can be touched, as a share of d_c: half the edge of the cube that holds one point, so that
neighbours just meet. The forbidden spheres around them reach farther, and are what must not be touched."""


def build_plant(
    name: str,
    robot: SceneRobot,
    start: Array,
    decided: np.ndarray,
    period: float,
    *,
    clouds: Mapping[str, PointCloud],
    seed: int,
    port: tuple[ArrayLike, float, ArrayLike] | None = None,
    tool_end: str | None = None,
) -> Plant:
    """A plant of that name.

    Parameters
    ----------
    robot, start, decided, period : what moves, (n,) from where, (d,) which joints, and T in seconds.
    clouds : the anatomy. seed : of everything random.
    port : centre (3,), radius and axis (3,) of the entry port, world, metres. tool_end : see
        `scenarios.plants.mujoco.MujocoPlant`.

    Raises
    ------
    UnknownNameError : no such plant. InputError, ModelError : see `scenarios.plants.mujoco.MujocoPlant`.
    """
    known("plant", name, PLANTS)
    if name == "kinematic":
        return KinematicPlant(start, decided, period, seed=seed)
    from scenarios.plants.mujoco import COARSEST, MujocoPlant
    from scenarios.plants.obstacles import Cloud, Port

    return MujocoPlant(
        entry_of(robot),
        start,
        decided,
        period,
        port=Port(*port) if port is not None else None,
        clouds=[Cloud(part, cloud.world_points, cloud.radius * TOUCHED) for part, cloud in clouds.items()],
        physics_step=period / np.ceil(period / COARSEST * (1.0 - 1e-9)),
        tool_end=tool_end,
        seed=seed,
    )
