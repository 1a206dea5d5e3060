"""The anatomy of a scene: which surfaces, where they lie, and the clouds that cover them.

They are placed from a point: the entry port of a hands-on scene, the world's origin where a trajectory is followed.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple, Self, get_args

import numpy as np
from numpy.typing import ArrayLike

from primitives import dual_quaternion as dq
from primitives.checks import Array, array, known, number
from primitives.constraint import Constraint
from primitives.elements import WORLD, Cloud
from primitives.errors import FileError, InputError
from primitives.files.mesh_file import read_surface
from primitives.point_cloud import IDENTITY, Gaps, PointCloud
from primitives.surface import Surface
from primitives.units import METRES, check_size
from scenarios.anatomy import Bowl, Shape, cortex, kidney, under_port

FILES = "files"
KINDS = ("bowl", "cortex", "kidney", FILES)
EXPECTED = 0.1
"""About how long a part on a file is, metres; ten times as much or as little is another unit."""


@dataclass(frozen=True)
class AnatomySource:
    """Where the anatomy of a scene comes from and how it lies, from the port, or the world's origin without one.

    Attributes
    ----------
    kind : "kidney" or "cortex", an organ with vessels; "bowl"; or "files". See `scenarios.anatomy`.
    cover : {part: d_c}, radius of the spheres that cover it, metres. Parts are "organ" and "vessels", or "bowl".
    at : (3,) of the origin of a procedural anatomy, relative to that point, metres, world axes.
    turn : about the world's z axis, rad; of files about the axis down through that point.
    radius, opening : of a bowl, metres and rad.
    organ, vessels : files (PLY, STL, OBJ, GLB, PCD), of which one may be missing. unit : of their coordinates.
    depth : of the nearest point of files below that point, metres.
    gaps : "refuse" files of points that leave gaps wider than d_c, or "fill" them.

    Raises
    ------
    InputError, UnknownNameError : an unknown kind, part or unit, a number out of range, or no file.
    """

    kind: str
    cover: Mapping[str, float]
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: float = 0.0
    radius: float = 0.012
    opening: float = 1.4
    organ: str = ""
    vessels: str = ""
    unit: str = "m"
    depth: float = 0.1
    gaps: Gaps = "refuse"

    def __post_init__(self) -> None:
        known("kind of anatomy", self.kind, KINDS)
        known("unit of length", self.unit, METRES)
        known("way to treat gaps", self.gaps, get_args(Gaps))
        for name in self.parts:
            if name not in self.cover:
                raise InputError(f'cover of the anatomy: expected a radius for "{name}", got {dict(self.cover)}')
        for name, radius in self.cover.items():
            known("part of the anatomy", name, ("organ", "vessels", "bowl"))
            number(radius, f'cover of "{name}", metres', positive=True)
        object.__setattr__(self, "at", tuple(array(self.at, (3,), "at of the anatomy").tolist()))
        number(self.turn, "turn of the anatomy, rad")
        for name in ("radius", "opening", "depth"):
            number(getattr(self, name), f"{name} of the anatomy", positive=True)
        if (self.kind == FILES) != bool(self.organ or self.vessels):
            raise InputError(f'anatomy "{self.kind}": files (organ, vessels) go with the kind "{FILES}", and need it')

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of the parts."""
        return part_names(self.kind, self.organ, self.vessels)

    def located(self, folder: Path) -> Self:
        """The same with whole paths of its files, from a folder where they do not say from where."""
        organ, vessels = (str((folder / file).absolute()) if file else "" for file in (self.organ, self.vessels))
        return replace(self, organ=organ, vessels=vessels)


def part_names(kind: str, organ: object, vessels: object) -> tuple[str, ...]:
    """Names of the parts of an anatomy of that kind; on files those whose file is named."""
    if kind == FILES:
        return tuple(name for name, file in (("organ", organ), ("vessels", vessels)) if file)
    return ("bowl",) if kind == "bowl" else ("organ", "vessels")


class Part(NamedTuple):
    """A part of the anatomy.

    Attributes
    ----------
    cloud : its surface, covered by spheres, at its place in the world.
    surface : triangles to draw, in the world; without faces where a file had only points.
    shape : of a procedural part, with the exact distance; None of a file.
    """

    cloud: PointCloud
    surface: Surface
    shape: Shape | None


def placed_cloud(constraint: Constraint, parts: Mapping[str, Part]) -> PointCloud:
    """The cloud of a constraint in the world: that of its part, moved as its element says.

    Raises
    ------
    InputError : its second element is no cloud, or one that moves.
    UnknownNameError : no such part.
    """
    element = constraint.second
    if not isinstance(element, Cloud):
        raise InputError(f'constraint "{constraint.name}": expected a cloud as its second element, got {element.kind}')
    if element.frame != WORLD or element.entity is not None:
        raise InputError(
            f'constraint "{constraint.name}": expected a cloud that stands still in the world, got one on '
            f'"{element.entity or element.frame}"'
        )
    cloud = parts[known("part of the anatomy", element.name, parts)].cloud
    as_it_is = np.array_equal(element.dual_quaternion, IDENTITY)
    return cloud if as_it_is else cloud.moved(dq.product(np.array(element.dual_quaternion), np.array(cloud.pose)))


ORIGIN = (0.0, 0.0, 0.0)


def build_parts(source: AnatomySource | None, origin: ArrayLike = ORIGIN, seed: int = 0) -> dict[str, Part]:
    """Every part by name, at its place; the same for the same seed; none where there is no anatomy.

    origin : (3,) the point from which it is placed, world, metres: the port of a hands-on scene.

    Raises
    ------
    FileError, InputError : a file that cannot be read, in another unit, or whose points leave gaps.
    """
    if source is None:
        return {}
    port = array(origin, (3,), "point from which the anatomy is placed")
    if source.kind == FILES:
        return _from_files(source, port, seed)
    half = 0.5 * source.turn
    turned = np.array([np.cos(half), 0.0, 0.0, np.sin(half)])
    pose = dq.from_rotation_translation(turned, port + source.at)
    shapes: dict[str, Shape]
    if source.kind == "bowl":
        shapes = {"bowl": Bowl(source.radius, source.opening).placed(pose)}
    else:
        anatomy = (kidney if source.kind == "kidney" else cortex)().placed(pose)
        shapes = {"organ": anatomy.organ, "vessels": anatomy.vessels}
    return {
        name: Part(shape.cloud(source.cover[name], seed), shape.surface(0.5 * source.cover[name]), shape)
        for name, shape in shapes.items()
    }


def _from_files(source: AnatomySource, port: Array, seed: int) -> dict[str, Part]:
    surfaces = {}
    for name in source.parts:
        file = getattr(source, name)
        surfaces[name] = read_surface(Path(file), unit=source.unit)
        extent = float(np.ptp(surfaces[name].bounds, axis=0).max())
        check_size(extent, EXPECTED, unit=source.unit, what=file)
    vessels = surfaces.get("vessels", next(iter(surfaces.values())))
    if len(surfaces) == 2:
        pose = under_port(port, source.depth, vessels=vessels, organ=surfaces["organ"], turn=source.turn)
    else:
        top = vessels.vertices[np.argmax(vessels.vertices[:, 2])]
        pose = dq.from_rotation_translation(np.array([1.0, 0.0, 0.0, 0.0]), port - [0.0, 0.0, source.depth] - top)
    parts = {}
    for name, surface in surfaces.items():
        radius = source.cover[name]
        if len(surface.faces):
            cloud = PointCloud.from_surface(surface, radius=radius, seed=seed, pose=pose)
        else:
            try:
                cloud = PointCloud.from_points(surface.vertices, radius=radius, gaps=source.gaps, pose=pose)
            except InputError as error:
                raise FileError(getattr(source, name), f"{error}. On the command line: --fill-gaps") from None
        parts[name] = Part(cloud, surface.placed(pose), None)
    return parts
