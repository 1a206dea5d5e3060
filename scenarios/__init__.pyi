from .analysis.trace import Trace as Trace
from .scene import Scene as Scene
from .scene_file import dump_scene as dump_scene
from .scene_file import load_scene as load_scene
from .trajectory import PoseTrajectory as PoseTrajectory
from .trajectory import Waypoint as Waypoint

__all__ = [
    "PoseTrajectory",
    "Scene",
    "Trace",
    "Waypoint",
    "dump_scene",
    "load_scene",
]
