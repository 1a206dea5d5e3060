from .constraint import Constraint as Constraint
from .constraint import ConstraintSet as ConstraintSet
from .dh import DHRow as DHRow
from .elements import (
    Cloud as Cloud,
)
from .elements import (
    Element as Element,
)
from .elements import (
    Line as Line,
)
from .elements import (
    Plane as Plane,
)
from .elements import (
    Point as Point,
)
from .elements import (
    Segment as Segment,
)
from .errors import (
    ActiveConstraintsError as ActiveConstraintsError,
)
from .errors import (
    FileError as FileError,
)
from .errors import (
    InactiveConstraintError as InactiveConstraintError,
)
from .errors import (
    InputError as InputError,
)
from .errors import (
    ModelError as ModelError,
)
from .errors import (
    SolverError as SolverError,
)
from .errors import (
    UnknownNameError as UnknownNameError,
)
from .evaluate import Entity as Entity
from .evaluate import Evaluation as Evaluation
from .files.mesh_file import read_surface as read_surface
from .intrinsics import PAIR_SIGNATURE as PAIR_SIGNATURE
from .kinematics import Kinematics as Kinematics
from .pair import Pair as Pair
from .point_cloud import PointCloud as PointCloud
from .rcm import RCM as RCM
from .robot import Limits as Limits
from .robot import Robot as Robot
from .spec import dump_constraints as dump_constraints
from .spec import load_constraints as load_constraints
from .surface import Surface as Surface
from .units import check_size as check_size
from .voxel_grid import VoxelGrid as VoxelGrid
from .voxel_grid import build_grid as build_grid

__all__ = [
    "PAIR_SIGNATURE",
    "RCM",
    "ActiveConstraintsError",
    "Cloud",
    "Constraint",
    "ConstraintSet",
    "DHRow",
    "Element",
    "Entity",
    "Evaluation",
    "FileError",
    "InactiveConstraintError",
    "InputError",
    "Kinematics",
    "Limits",
    "Line",
    "ModelError",
    "Pair",
    "Plane",
    "Point",
    "PointCloud",
    "Robot",
    "Segment",
    "SolverError",
    "Surface",
    "UnknownNameError",
    "VoxelGrid",
    "build_grid",
    "check_size",
    "dump_constraints",
    "load_constraints",
    "read_surface",
]
