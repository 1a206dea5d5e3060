"""The plants that a hands-on scene can run on."""

from collections.abc import Mapping

import numpy as np

from primitives.checks import known
from primitives.point_cloud import PointCloud
from primitives.robot import Robot
from scenarios.hands_on.scene import HandsOnScene
from scenarios.own_robot import entry_of
from scenarios.plants import Plant
from scenarios.plants.kinematic import KinematicPlant

PLANTS = ("kinematic", "mujoco")
TOUCHED = 1.0 / np.sqrt(3.0)
"""Radius of a sphere that can be touched, as a share of d_c: half the edge of the cube that holds one point, so that
neighbours just meet. The forbidden spheres around them reach farther, and are what must not be touched."""


def build_plant(name: str, scene: HandsOnScene, robot: Robot, clouds: Mapping[str, PointCloud], seed: int) -> Plant:
    """A plant of that name at the start of a scene.

    Raises
    ------
    UnknownNameError : no such plant. InputError, ModelError : see `scenarios.plants.mujoco.MujocoPlant`.
    """
    known("plant", name, PLANTS)
    start, decided = np.array(scene.start), robot.group(scene.group)
    if name == "kinematic":
        return KinematicPlant(start, decided, scene.period, seed=seed)
    from scenarios.plants.mujoco import COARSEST, MujocoPlant
    from scenarios.plants.obstacles import Cloud, Port

    axis = robot.kinematics(start).rotation(scene.shaft)[:, 2]
    return MujocoPlant(
        entry_of(scene.robot),
        start,
        decided,
        scene.period,
        port=Port(scene.port, scene.port_radius, axis=axis),
        clouds=[Cloud(part, cloud.world_points, cloud.radius * TOUCHED) for part, cloud in clouds.items()],
        physics_step=scene.period / np.ceil(scene.period / COARSEST * (1.0 - 1e-9)),
        tool_end=scene.shaft,
        seed=seed,
    )
