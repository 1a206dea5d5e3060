"""The plant that a hands-on scene runs on."""

from collections.abc import Mapping

import numpy as np

from primitives.point_cloud import PointCloud
from primitives.robot import Robot
from scenarios.hands_on.scene import HandsOnScene
from scenarios.plants import Plant
from scenarios.plants.build import build_plant


def plant_of(scene: HandsOnScene, robot: Robot, clouds: Mapping[str, PointCloud]) -> Plant:
    """The scene's plant at its start, with its port; raises as `scenarios.plants.build.build_plant`."""
    start = np.array(scene.start)
    axis = robot.kinematics(start).rotation(scene.shaft)[:, 2]
    return build_plant(
        scene.plant,
        scene.robot,
        start,
        robot.group(scene.group),
        scene.period,
        clouds=clouds,
        seed=scene.seed,
        port=(scene.port, scene.port_radius, axis),
        tool_end=scene.shaft,
    )
