"""PLY files: ascii and binary of either byte order, with or without faces.

Elements other than vertices and faces are passed over, as are all properties but x, y, z and the faces' vertex list.
"""

from typing import NamedTuple

import numpy as np

from primitives.checks import Array
from primitives.files.raw import Raw

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_ORDERS = {b"ascii": "", b"binary_little_endian": "<", b"binary_big_endian": ">"}
_LISTS = (b"vertex_indices", b"vertex_index")
_MAX_HEADER = 65_536
_MAX_PROPERTIES = 256


class _Property(NamedTuple):
    name: bytes
    type: str
    length: str  # type of a list's length; "" for a single value


class _Element(NamedTuple):
    name: bytes
    rows: int
    properties: list[_Property]


class _Header(NamedTuple):
    order: str
    elements: list[_Element]
    lines: int
    end: int


def read_ply(raw: Raw) -> tuple[Array, np.ndarray]:
    """Vertices (V, 3) and triangles (F, 3), F = 0 for points only; polygons become fans.

    Raises
    ------
    FileError : whatever is wrong with the file.
    """
    header = _header(raw)
    reader = _Ascii(raw, header) if not header.order else _Binary(raw, header)
    vertices: Array | None = None
    faces: list[np.ndarray] | np.ndarray = np.zeros((0, 3), dtype=np.int64)
    for element in header.elements:
        if element.name == b"vertex":
            names = [p.name for p in element.properties]
            if any(p.length for p in element.properties) or not {b"x", b"y", b"z"} <= set(names):
                raw.refuse("element vertex: expected single properties x, y and z")
            vertices = raw.finite(reader.columns(element, [names.index(c) for c in (b"x", b"y", b"z")]), "vertices")
        elif element.name == b"face":
            lists = [i for i, p in enumerate(element.properties) if p.length and p.name in _LISTS]
            if element.rows and (len(lists) != 1 or element.properties[lists[0]].type[0] == "f"):
                raw.refuse("element face: expected one list of whole numbers vertex_indices")
            faces = reader.lists(element, lists[0]) if element.rows else faces
        elif element.name == b"tristrips":
            raw.refuse("holds triangle strips, which are not read; save it with faces")
        else:
            reader.skip(element)
    reader.finish()
    if vertices is None:
        raw.refuse('has no element "vertex"')
    if isinstance(faces, list):
        return vertices, raw.polygons(faces, len(vertices))
    return vertices, raw.faces(faces, len(vertices))


def _header(raw: Raw) -> _Header:
    end = raw.data.find(b"end_header", 0, _MAX_HEADER)
    newline = raw.data.find(b"\n", end, end + 20) if end >= 0 else -1
    if newline < 0:
        raw.refuse(f'the header of a PLY file ends with a line "end_header" within {_MAX_HEADER} bytes; there is none')
    lines = raw.data[:end].splitlines()
    order, elements = None, list[_Element]()
    if lines[0].strip() != b"ply":
        raw.refuse(f'a PLY file begins with a line "ply"; this one with {raw.shown(lines[0])!r}', 1)
    for number, line in enumerate(lines[1:], 2):
        match line.split():
            case [] | [b"comment", *_] | [b"obj_info", *_]:
                pass
            case [b"format", word, b"1.0"] if word in _ORDERS:
                order = _ORDERS[word]
            case [b"element", name, count]:
                if any(e.name == name for e in elements):
                    raw.refuse(f"element {raw.shown(name)!r} is declared twice", number)
                elements.append(_Element(name, raw.count(count, f"element {raw.shown(name)}", number), []))
            case [b"property", b"list", count, kind, name] if elements and {_text(count), _text(kind)} <= set(_TYPES):
                if _TYPES[_text(count)][0] == "f":
                    raw.refuse("the length of a list is a whole number", number)
                elements[-1].properties.append(_Property(name, _TYPES[_text(kind)], _TYPES[_text(count)]))
            case [b"property", kind, name] if elements and _text(kind) in _TYPES:
                elements[-1].properties.append(_Property(name, _TYPES[_text(kind)], ""))
            case _:
                raw.refuse(
                    f"expected format (ascii, binary_little_endian or binary_big_endian 1.0), element, property, "
                    f"comment or end_header, got {raw.shown(line)!r}",
                    number,
                )
        if elements and len(elements[-1].properties) > _MAX_PROPERTIES:
            raw.refuse(f"more than {_MAX_PROPERTIES} properties of one element", number)
    if order is None:
        raw.refuse('the header has no line "format"')
    for element in elements:
        names = [p.name for p in element.properties]
        if not names or len(set(names)) < len(names):
            raw.refuse(f"element {raw.shown(element.name)!r}: expected properties of different names")
    return _Header(order, elements, len(lines) + 1, newline + 1)


def _text(word: bytes) -> str:
    return word.decode("latin-1")


class _Ascii:
    """Elements of an ascii file, one a line."""

    def __init__(self, raw: Raw, header: _Header):
        self.raw, self.at = raw, 0
        every = raw.data[header.end :].splitlines()
        kept = [(line, number) for number, line in enumerate(every, header.lines + 1) if line.strip()]
        self.lines, self.numbers = [line for line, _ in kept], [number for _, number in kept]

    def _take(self, element: _Element) -> tuple[list[bytes], list[int]]:
        start, self.at = self.at, self.at + element.rows
        if self.at > len(self.lines):
            self.raw.refuse(
                f"element {self.raw.shown(element.name)}: {element.rows} lines are announced, but only "
                f"{len(self.lines) - start} are left; is the file cut off?"
            )
        return self.lines[start : self.at], self.numbers[start : self.at]

    def columns(self, element: _Element, places: list[int]) -> np.ndarray:
        lines, numbers = self._take(element)
        if not lines:
            return np.zeros((0, len(places)))
        self.raw.table(lines, [len(element.properties) - 1], numbers, "a vertex with all its properties")
        return self.raw.table(lines, places, numbers, "vertex")

    def lists(self, element: _Element, place: int) -> list[np.ndarray] | np.ndarray:
        lines, numbers = self._take(element)
        if any(p.length for p in element.properties[:place]):
            self.raw.refuse("element face: a list before vertex_indices is not read")
        first = lines[0].split()
        wide = _length(first, place)
        if wide >= 3 and len(first) > place + wide:
            try:
                columns = range(place, place + wide + 1)
                table = np.loadtxt(lines, usecols=columns, ndmin=2, comments=None, dtype=np.int64)
            except (ValueError, OverflowError, UnicodeDecodeError):
                table = np.zeros((0, 1), dtype=np.int64)
            if len(table) == len(lines) and (table[:, 0] == wide).all():
                return table[:, 1:]
        self.raw.few_polygons(element.rows)
        out = []
        for line, number in zip(lines, numbers, strict=True):
            words = line.split()
            wide = _length(words, place)
            corners = [_length(words, place + 1 + i) for i in range(max(min(wide, len(words)), 0))]
            if wide < 3 or len(corners) < wide or min(corners) < 0:
                self.raw.refuse(f"face: expected 3 or more, and so many vertices, got {self.raw.shown(line)!r}", number)
            out.append(np.array(corners, dtype=np.int64))
        return out

    def skip(self, element: _Element) -> None:
        self._take(element)

    def finish(self) -> None:
        if self.at < len(self.lines):
            self.raw.refuse("more lines than the header announces", self.numbers[self.at])


def _length(words: list[bytes], place: int) -> int:
    """The whole number at a place of a line, or -1."""
    return int(words[place]) if place < len(words) and words[place].isdigit() and len(words[place]) < 19 else -1


class _Binary:
    """Elements of a binary file."""

    def __init__(self, raw: Raw, header: _Header):
        self.raw, self.order, self.at = raw, header.order, header.end

    def _records(self, element: _Element, lengths: dict[int, int]) -> np.ndarray:
        """Records whose lists have the given lengths."""
        fields: list[tuple[str, str] | tuple[str, str, int]] = []
        for i, p in enumerate(element.properties):
            if p.length:
                fields += [(f"n{i}", self.order + p.length), (f"p{i}", self.order + p.type, lengths[i])]
            else:
                fields.append((f"p{i}", self.order + p.type))
        return self.raw.part(self.at, np.dtype(fields), element.rows, f"element {self.raw.shown(element.name)}")

    def columns(self, element: _Element, places: list[int]) -> np.ndarray:
        records = self._records(element, {})
        self.at += records.nbytes
        return np.stack([records[f"p{i}"].astype(np.float64) for i in places], axis=-1)

    def lists(self, element: _Element, place: int) -> list[np.ndarray] | np.ndarray:
        lengths = self._first_lengths(element)
        size = self._size(element, lengths)
        if lengths[place] >= 3 and self.at + element.rows * size <= len(self.raw.data):
            records = self._records(element, lengths)
            if all((records[f"n{i}"] == n).all() for i, n in lengths.items()):
                self.at += records.nbytes
                return records[f"p{place}"].astype(np.int64).reshape(element.rows, -1)
        self.raw.few_polygons(element.rows)
        return [self._next(element, place) for _ in range(element.rows)]

    def _first_lengths(self, element: _Element) -> dict[int, int]:
        lengths, at = {}, self.at
        for i, p in enumerate(element.properties):
            if p.length:
                lengths[i] = self._whole(at, p, element)
                at += np.dtype(p.length).itemsize + lengths[i] * np.dtype(p.type).itemsize
            else:
                at += np.dtype(p.type).itemsize
        return lengths

    def _size(self, element: _Element, lengths: dict[int, int]) -> int:
        sizes = [np.dtype(p.type).itemsize for p in element.properties]
        return sum(
            np.dtype(p.length).itemsize + lengths[i] * size if p.length else size
            for i, (p, size) in enumerate(zip(element.properties, sizes, strict=True))
        )

    def _whole(self, at: int, p: _Property, element: _Element) -> int:
        what = f"element {self.raw.shown(element.name)}"
        length = int(self.raw.part(at, self.order + p.length, 1, what)[0])
        if not 0 <= length <= len(self.raw.data):
            self.raw.refuse(f"{what}: a list of {length} values in a file of {len(self.raw.data)} bytes")
        return length

    def _next(self, element: _Element, place: int) -> np.ndarray:
        """The list at a place of the next record."""
        kept = np.zeros(0, dtype=np.int64)
        for i, p in enumerate(element.properties):
            length = self._whole(self.at, p, element) if p.length else 1
            self.at += np.dtype(p.length).itemsize if p.length else 0
            values = self.raw.part(self.at, self.order + p.type, length, f"element {self.raw.shown(element.name)}")
            self.at += values.nbytes
            if i == place:
                kept = values.astype(np.int64)
        return kept

    def skip(self, element: _Element) -> None:
        if any(p.length for p in element.properties):
            self.raw.few_polygons(element.rows)
            for _ in range(element.rows):
                self._next(element, -1)
        else:
            self.at += self._records(element, {}).nbytes

    def finish(self) -> None:
        left = self.raw.data[self.at :]
        if left.strip():
            self.raw.refuse(f"{len(left)} bytes more than the header announces")
