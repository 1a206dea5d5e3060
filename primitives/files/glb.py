"""Binary glTF 2.0 files (GLB): the triangles of the default scene, each node's transform applied.

What a file refers to outside of itself is never opened. Axes are kept as they are: glTF calls y up.
"""

import json
import struct
from collections.abc import Iterator
from typing import Any, NoReturn

import numpy as np

from primitives.checks import Array
from primitives.files.raw import Raw

MAX_VERTICES = 5_000_000
"""Of all meshes, each counted as often as a node shows it."""

_MAX_JSON = 16 * 1024 * 1024
_INDEX_TYPES = {5121: "u1", 5123: "<u2", 5125: "<u4"}
_FLOAT = 5126
_POINTS, _TRIANGLES = 0, 4


def read_glb(raw: Raw) -> tuple[Array, np.ndarray]:
    """Vertices (V, 3) and triangles (F, 3) of all nodes that the default scene shows; F = 0 for points only.

    Raises
    ------
    FileError : whatever is wrong with the file, or what is not read: sparse or compressed data, buffers outside of
        the file, triangle strips and fans.
    """
    return _Scene(raw).collected()


class _Scene:
    def __init__(self, raw: Raw):
        self.raw = raw
        self.json, self.start, self.size = self._chunks()

    def _chunks(self) -> tuple[dict[str, Any], int, int]:
        """The JSON chunk, and where the binary chunk begins and how long it is."""
        data = self.raw.data
        if data[:4] != b"glTF" or len(data) < 20:
            self.raw.refuse(f'a GLB file begins with "glTF"; this one with {self.raw.shown(data[:4])!r}')
        version, length, size, kind = struct.unpack_from("<4I", data, 4)
        if version != 2 or length != len(data):
            self.raw.refuse(f"expected version 2 and {len(data)} bytes, the header says {version} and {length}")
        if kind != 0x4E4F534A or size > min(len(data) - 20, _MAX_JSON):
            self.raw.refuse(
                f"expected a JSON chunk of at most {min(len(data) - 20, _MAX_JSON)} bytes first, got {size}"
            )
        try:
            content = json.loads(data[20 : 20 + size], parse_constant=self._no_number)
        except (ValueError, RecursionError) as error:
            self.raw.refuse(f"its JSON chunk cannot be read ({error})")
        if not isinstance(content, dict):
            self.raw.refuse("its JSON chunk should hold keys and values")
        at = 20 + size
        if at == len(data):
            return content, at, 0
        if at + 8 > len(data):
            self.raw.refuse("is cut off after its JSON chunk")
        binary, kind = struct.unpack_from("<2I", data, at)
        if kind != 0x004E4942 or at + 8 + binary > len(data):
            self.raw.refuse(f"expected a BIN chunk of at most {len(data) - at - 8} bytes, got {binary}")
        return content, at + 8, binary

    def _no_number(self, text: str) -> NoReturn:
        self.raw.refuse(f"its JSON chunk holds {text}")

    def _item(self, kind: str, index: Any) -> dict[str, Any]:
        """One of the objects under a key at the top."""
        every = self.json.get(kind, [])
        if not isinstance(every, list) or type(index) is not int or not 0 <= index < len(every):
            self.raw.refuse(f"refers to {kind}[{self._shown(index)}], which does not exist")
        if not isinstance(every[index], dict):
            self.raw.refuse(f"{kind}[{index}] should hold keys and values")
        item: dict[str, Any] = every[index]
        return item

    def _shown(self, value: Any) -> str:
        return self.raw.shown(repr(value)[:80].encode())

    def _list(self, owner: dict[str, Any], key: str) -> list[Any]:
        value = owner.get(key, [])
        if not isinstance(value, list):
            self.raw.refuse(f"{key}: expected a list, got {self._shown(value)}")
        return value

    def _whole(self, owner: dict[str, Any], key: str, default: int) -> int:
        value = owner.get(key, default)
        if type(value) is not int or not 0 <= value <= len(self.raw.data):
            self.raw.refuse(f"{key}: expected a whole number of at most the file's bytes, got {self._shown(value)}")
        return value

    def _numbers(self, owner: dict[str, Any], key: str, default: list[float]) -> Array:
        value = owner.get(key, default)
        ok = isinstance(value, list) and len(value) == len(default) and all(type(x) in (int, float) for x in value)
        if not ok or not all(abs(x) < 1e30 for x in value):
            self.raw.refuse(f"{key}: expected {len(default)} finite numbers, got {self._shown(value)}")
        return np.array(value, dtype=np.float64)

    def collected(self) -> tuple[Array, np.ndarray]:
        required = self._list(self.json, "extensionsRequired")
        if required:
            self.raw.refuse(f"needs extensions, which are not read: {self._shown(required)}")
        vertices, faces, count = [np.zeros((0, 3))], [np.zeros((0, 3), dtype=np.int64)], 0
        for mesh, transform in self._shown_meshes():
            for points, triangles in self._primitives(self._item("meshes", mesh)):
                if count + len(points) > MAX_VERTICES:
                    self.raw.refuse(f"shows more than {MAX_VERTICES} vertices")
                with np.errstate(over="ignore", invalid="ignore"):
                    vertices.append(points.astype(np.float64) @ transform[:3, :3].T + transform[:3, 3])
                faces.append(triangles + count)
                count += len(points)
        return self.raw.finite(np.concatenate(vertices), "vertices"), np.concatenate(faces)

    def _shown_meshes(self) -> Iterator[tuple[Any, Array]]:
        """Each mesh that a node of the default scene shows, with the node's transform (4, 4)."""
        nodes = self._list(self.json, "nodes")
        if self._list(self.json, "scenes"):
            roots = self._list(self._item("scenes", self.json.get("scene", 0)), "nodes")
        else:
            below = {self._shown(c) for n in nodes if isinstance(n, dict) for c in self._list(n, "children")}
            roots = [i for i in range(len(nodes)) if str(i) not in below]
        ahead, seen = [(r, np.eye(4)) for r in roots], set[int]()
        while ahead:
            index, parent = ahead.pop()
            node = self._item("nodes", index)
            if index in seen:
                self.raw.refuse(f"nodes[{index}] has two parents, or is its own ancestor")
            seen.add(index)
            with np.errstate(over="ignore", invalid="ignore"):
                transform = parent @ self._transform(node)
            ahead += [(c, transform) for c in self._list(node, "children")]
            if "mesh" in node:
                yield node["mesh"], transform

    def _transform(self, node: dict[str, Any]) -> Array:
        """Of a node: its matrix, given column by column, or scale, then rotation [x y z w], then translation."""
        if "matrix" in node:
            return self._numbers(node, "matrix", [0.0] * 16).reshape(4, 4).T
        x, y, z, w = self._numbers(node, "rotation", [0.0, 0.0, 0.0, 1.0])
        n = x * x + y * y + z * z + w * w
        if not 0.99 < n < 1.01:
            self.raw.refuse(f"rotation: expected a unit quaternion, got {self._shown(node['rotation'])}")
        out = np.eye(4)
        out[:3, :3] = [
            [1.0 - 2.0 * (y * y + z * z) / n, 2.0 * (x * y - w * z) / n, 2.0 * (x * z + w * y) / n],
            [2.0 * (x * y + w * z) / n, 1.0 - 2.0 * (x * x + z * z) / n, 2.0 * (y * z - w * x) / n],
            [2.0 * (x * z - w * y) / n, 2.0 * (y * z + w * x) / n, 1.0 - 2.0 * (x * x + y * y) / n],
        ]
        out[:3, :3] *= self._numbers(node, "scale", [1.0, 1.0, 1.0])
        out[:3, 3] = self._numbers(node, "translation", [0.0, 0.0, 0.0])
        return out

    def _primitives(self, mesh: dict[str, Any]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        for part in self._list(mesh, "primitives"):
            if not isinstance(part, dict) or not isinstance(part.get("attributes"), dict):
                self.raw.refuse("a primitive of a mesh should hold keys and values, attributes among them")
            mode = part.get("mode", _TRIANGLES)
            if mode not in (_POINTS, _TRIANGLES):
                self.raw.refuse(f"holds primitives of mode {self._shown(mode)}; only triangles and points are read")
            points = self._accessor(part["attributes"].get("POSITION"), "VEC3")
            if mode == _POINTS:
                yield points, np.zeros((0, 3), dtype=np.int64)
                continue
            indices = self._accessor(part["indices"], "SCALAR") if "indices" in part else np.arange(len(points))
            if len(indices) % 3:
                self.raw.refuse(f"{len(indices)} indices do not make triangles")
            yield points, self.raw.faces(indices.reshape(-1, 3), len(points))

    def _accessor(self, index: Any, kind: str) -> np.ndarray:
        """The values of an accessor, (n, 3) floats for VEC3 or (n,) whole numbers for SCALAR."""
        accessor = self._item("accessors", index)
        component = accessor.get("componentType")
        types = {_FLOAT: "<f4"} if kind == "VEC3" else _INDEX_TYPES
        if accessor.get("type") != kind or type(component) is not int or component not in types:
            self.raw.refuse(f"accessors[{index}]: expected {kind} of component type {' or '.join(map(str, types))}")
        if "sparse" in accessor or "bufferView" not in accessor:
            self.raw.refuse(f"accessors[{index}]: data that are sparse or compressed are not read")
        view = self._item("bufferViews", accessor["bufferView"])
        if view.get("buffer") != 0 or "uri" in self._item("buffers", 0):
            self.raw.refuse(f"accessors[{index}]: only the buffer in the file itself is read")
        shape = (3,) if kind == "VEC3" else ()
        value = np.dtype((types[component], shape))
        count = self._whole(accessor, "count", 0)
        stride = self._whole(view, "byteStride", 0) or value.itemsize
        offset = self._whole(accessor, "byteOffset", 0)
        length, first = self._whole(view, "byteLength", 0), self._whole(view, "byteOffset", 0)
        last = offset + (count - 1) * stride + value.itemsize if count else 0
        if stride < value.itemsize or last > length or first + length > self.size:
            self.raw.refuse(f"accessors[{index}]: {count} values reach beyond the {self.size} bytes of the BIN chunk")
        if not count:
            return np.zeros((0, *shape), dtype=types[component])
        raw = np.frombuffer(self.raw.data, np.uint8, last - offset, self.start + first + offset)
        item = np.dtype(types[component]).itemsize
        strides = (stride, item) if shape else (stride,)
        return np.ndarray((count, *shape), types[component], raw, 0, strides)
