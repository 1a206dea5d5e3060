"""Files of geometry, which may be hostile, as a `Surface` in metres: PLY, STL, OBJ, GLB and PCD.

The formats are read here and not by a mesh library: trimesh takes a truncated STL for an empty scene, accepts NaN, and
believes the counts of a header. Nothing is executed, no other file is opened, and what a header announces is held
against the file's size before any memory is taken for it.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from primitives.checks import Array
from primitives.errors import InputError, UnknownNameError
from primitives.files.glb import read_glb
from primitives.files.obj import read_obj
from primitives.files.pcd import read_pcd
from primitives.files.ply import read_ply
from primitives.files.raw import Raw
from primitives.files.stl import read_stl
from primitives.surface import Surface
from primitives.units import metres


def _points(raw: Raw) -> tuple[Array, np.ndarray]:
    return read_pcd(raw), np.zeros((0, 3), dtype=np.int64)


_READERS: dict[str, Callable[[Raw], tuple[Array, np.ndarray]]] = {
    ".glb": read_glb,
    ".obj": read_obj,
    ".pcd": _points,
    ".ply": read_ply,
    ".stl": read_stl,
}

SUFFIXES = tuple(_READERS)
"""Endings of the files that `read_surface` reads."""

_BEGINNINGS = ((b"glTF", ".glb"), (b"ply\n", ".ply"), (b"ply\r", ".ply"), (b"# .PCD", ".pcd"), (b"VERSION", ".pcd"))


def read_surface(path: str | Path, *, unit: str = "m") -> Surface:
    """The surface in a file, or the points where it holds no faces; the file's ending says which format it is.

    Parameters
    ----------
    unit : "m", "cm" or "mm", in which the file's coordinates are.

    Raises
    ------
    FileError : whatever is wrong with the file; names it, and the line or element.
    UnknownNameError : another unit.
    """
    size = metres(unit)
    raw = Raw(path)
    suffix = Path(path).suffix.lower()
    if suffix not in _READERS:
        raw.refuse(str(UnknownNameError("ending of a file of geometry", suffix, SUFFIXES)))
    for beginning, right in _BEGINNINGS:
        if raw.data.startswith(beginning) and suffix != right:
            raw.refuse(f'begins like a "{right}" file, but its name ends with "{suffix}"; rename it')
    vertices, faces = _READERS[suffix](raw)
    try:
        return Surface(vertices * size, faces)
    except InputError as error:
        raw.refuse(str(error))
