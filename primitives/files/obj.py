"""Wavefront OBJ files: vertices and faces. Materials, textures and other files that one names are never opened."""

import re

import numpy as np

from primitives.checks import Array
from primitives.files.raw import Raw

_PASSED_OVER = frozenset(
    b"vn vt vp g o s usemtl mtllib usemap maplib l p cstype deg bmat step curv curv2 surf parm trim hole scrv sp end "
    b"con bevel c_interp d_interp lod shadow_obj trace_obj ctech stech mg".split()
)
_CORNER = re.compile(rb"(-?[0-9]{1,9})(?:/(?:-?[0-9]{1,9})?(?:/(?:-?[0-9]{1,9})?)?)?")


def read_obj(raw: Raw) -> tuple[Array, np.ndarray]:
    """Vertices (V, 3) and triangles (F, 3), F = 0 for points only; polygons become fans.

    Raises
    ------
    FileError : whatever is wrong with the file, with its line.
    """
    lines, numbers = list[bytes](), list[int]()
    faces, sizes = list[int](), list[int]()
    for number, line in enumerate(raw.data.splitlines(), 1):
        words = line.split()
        if not words or words[0].startswith(b"#"):
            continue
        if words[0] == b"v":
            lines.append(line)
            numbers.append(number)
        elif words[0] == b"f":
            if len(words) < 4:
                raw.refuse(f"face: expected at least 3 vertices, got {raw.shown(line)!r}", number)
            for word in words[1:]:
                corner = _CORNER.fullmatch(word)
                index = int(corner[1]) if corner else 0
                place = index - 1 if index > 0 else len(lines) + index
                if not index or place < 0:
                    raw.refuse(f"face: expected corners v, v/vt, v/vt/vn or v//vn, got {raw.shown(line)!r}", number)
                faces.append(place)
            sizes.append(len(words) - 1)
        elif words[0] not in _PASSED_OVER:
            raw.refuse(f"no statement of an OBJ file: {raw.shown(line)!r}", number)
    if not lines:
        raw.refuse("has no vertices")
    vertices = raw.finite(raw.table(lines, (1, 2, 3), numbers, "vertex"), "vertices")
    every = np.array(faces, dtype=np.int64)
    if len(set(sizes)) <= 1:
        return vertices, raw.faces(every.reshape(-1, sizes[0] if sizes else 3), len(vertices))
    raw.few_polygons(len(sizes))
    return vertices, raw.polygons(np.split(every, np.cumsum(sizes)[:-1]), len(vertices))
