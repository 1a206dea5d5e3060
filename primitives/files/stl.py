"""STL files, ascii and binary; corners that are equal to the digit become one vertex."""

import numpy as np

from primitives.checks import Array
from primitives.files.raw import Raw

_HEADER = 84
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_FACET = [b"facet", b"outer", b"vertex", b"vertex", b"vertex", b"endloop", b"endfacet"]


def read_stl(raw: Raw) -> tuple[Array, np.ndarray]:
    """Vertices (V, 3) and triangles (F, 3).

    Raises
    ------
    FileError : whatever is wrong with the file; a binary file whose size is not that of the triangles it announces.
    """
    said = int(np.frombuffer(raw.data, "<u4", 1, 80)[0]) if len(raw.data) >= _HEADER else -1
    if said >= 0 and len(raw.data) == _HEADER + said * _RECORD.itemsize:
        corners = raw.part(_HEADER, _RECORD, said, "triangles")["corners"].reshape(-1, 3)
    elif raw.data[:512].lstrip().lower().startswith(b"solid"):
        corners = _ascii(raw)
    else:
        raw.refuse(
            f"its header announces {said} triangles, which take {_HEADER + said * _RECORD.itemsize} bytes; it has "
            f"{len(raw.data)}, and does not begin with the word solid as an ascii STL file does. Is it cut off?"
            if said >= 0
            else f"has {len(raw.data)} bytes, too few for a binary STL file, and does not begin with the word solid"
        )
    points = raw.finite(corners, "corners of triangles")
    vertices, inverse = np.unique(points, axis=0, return_inverse=True)
    return vertices, inverse.reshape(-1, 3).astype(np.int64)


def _ascii(raw: Raw) -> np.ndarray:
    lines, numbers, kinds = list[bytes](), list[int](), list[bytes]()
    last, end = b"", 0
    for number, line in enumerate(raw.data.splitlines(), 1):
        word = line.split(None, 1)[0].lower() if line.strip() else b""
        if not word:
            continue
        last, end = word, number
        if word in (b"solid", b"endsolid"):
            continue
        if word != _FACET[len(kinds) % len(_FACET)]:
            expected = _FACET[len(kinds) % len(_FACET)].decode()
            raw.refuse(f'expected a line "{expected} ...", got {raw.shown(line)!r}', number)
        kinds.append(word)
        if word == b"vertex":
            lines.append(line)
            numbers.append(number)
    if last != b"endsolid" or len(kinds) % len(_FACET):
        raw.refuse('the last line should be "endsolid"; the file is cut off', end)
    return raw.table(lines, (1, 2, 3), numbers, "vertex") if lines else np.zeros((0, 3))
