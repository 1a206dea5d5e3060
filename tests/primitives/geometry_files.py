"""Files of geometry written by hand, whole and broken, for the tests of the readers."""

import json
import struct
from collections.abc import Iterator
from typing import Any

import numpy as np

VERTICES = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, -0.125]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
NAN, INF = float("nan"), float("inf")


def ply(
    order: str = "ascii", *, vertices: Any = VERTICES, faces: Any = FACES, count: int | None = None, kind: str = "float"
) -> bytes:
    """A PLY file with a property before, between and after those that are read, and an element of its own kind."""
    name = {"ascii": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
    header = (
        f"ply\nformat {name} 1.0\ncomment by hand\nelement thing 2\nproperty int a\nelement vertex "
        f"{len(vertices) if count is None else count}\nproperty uchar red\nproperty {kind} x\nproperty {kind} y\n"
        f"property short s\nproperty {kind} z\nelement face {len(faces)}\nproperty uchar flags\n"
        "property list uchar int vertex_indices\nproperty float quality\nend_header\n"
    ).encode()
    if order == "ascii":
        body = "7\n8\n" + "".join(f"255 {x!r} {y!r} 3 {z!r}\n" for x, y, z in np.asarray(vertices, float).tolist())
        return header + (body + "".join(f"1 {len(f)} {' '.join(map(str, f))} 0.5\n" for f in faces)).encode()
    f = {"float": "f", "double": "d"}[kind]
    out = struct.pack(f"{order}2i", 7, 8)
    out += b"".join(struct.pack(f"{order}B2{f}h{f}", 255, x, y, 3, z) for x, y, z in vertices)
    return header + out + b"".join(struct.pack(f"{order}BB{len(c)}if", 1, len(c), *c, 0.5) for c in faces)


def stl_binary(vertices: Any = VERTICES, faces: Any = FACES, *, count: int | None = None, start: bytes = b"") -> bytes:
    out = start.ljust(80, b" ") + struct.pack("<I", len(faces) if count is None else count)
    for face in faces:
        out += struct.pack("<12fH", 0.0, 0.0, 1.0, *np.asarray(vertices)[face].ravel(), 0)
    return out


def stl_ascii(vertices: Any = VERTICES, faces: Any = FACES) -> bytes:
    out = "solid one\n"
    for face in faces:
        corners = "".join(f"      vertex {x!r} {y!r} {z!r}\n" for x, y, z in np.asarray(vertices, float)[face].tolist())
        out += f"  facet normal 0 0 1\n    outer loop\n{corners}    endloop\n  endfacet\n"
    return (out + "endsolid one\n").encode()


def obj(vertices: Any = VERTICES, faces: Any = FACES) -> bytes:
    out = "# by hand\nmtllib ../../etc/passwd\no thing\n"
    out += "".join(f"v {x!r} {y!r} {z!r} 1 0 0\n" for x, y, z in np.asarray(vertices, float).tolist())
    forms = ("{0}", "{0}/1", "{0}//1", "{0}/1/1")
    return (
        out + "".join("f " + " ".join(forms[i % 4].format(v + 1) for v in f) + "\n" for i, f in enumerate(faces))
    ).encode()


def glb(
    vertices: Any = VERTICES, faces: Any = FACES, *, change: Any = None, stride: int = 0, index_type: int = 5123
) -> bytes:
    """A GLB file of two nodes that show one mesh: one as it is, one below a parent, moved, turned and scaled."""
    strided = {"byteStride": stride} if stride > 12 else {}
    positions = b"".join(struct.pack("<3f", *v).ljust(max(stride, 12), b"\0") for v in vertices)
    indices = np.asarray(faces).astype({5121: "u1", 5123: "<u2", 5125: "<u4"}[index_type]).tobytes()
    content: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [
            {"mesh": 0},
            {"children": [2], "translation": [1.0, 2.0, 3.0], "scale": [2.0, 2.0, 2.0]},
            {"mesh": 0, "rotation": [0.0, 0.0, 0.5**0.5, 0.5**0.5]},
            {"mesh": 0, "translation": [9.0, 9.0, 9.0]},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(vertices), "type": "VEC3"},
            {"bufferView": 1, "componentType": index_type, "count": int(np.size(faces)), "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(positions), **strided},
            {"buffer": 0, "byteOffset": len(positions), "byteLength": len(indices)},
        ],
        "buffers": [{"byteLength": len(positions) + len(indices)}],
    }
    if change is not None:
        change(content)
    return glb_of(json.dumps(content).encode(), positions + indices)


def glb_of(text: bytes, binary: bytes) -> bytes:
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    chunks = struct.pack("<2I", len(text), 0x4E4F534A) + text + struct.pack("<2I", len(binary), 0x004E4942) + binary
    return b"glTF" + struct.pack("<2I", 2, 12 + len(chunks)) + chunks


def lzf(data: bytes) -> bytes:
    """Packed by looking for the longest repetition of at least three bytes; slow, and enough for a test."""
    out, literal, i = bytearray(), bytearray(), 0

    def flush() -> None:
        for k in range(0, len(literal), 32):
            out.extend((len(literal[k : k + 32]) - 1, *literal[k : k + 32]))
        literal.clear()

    while i < len(data):
        size, at = 0, 0
        for back in range(max(0, i - 8191), i):
            n = 0
            while n < 264 and i + n < len(data) and data[back + n] == data[i + n]:
                n += 1
            if n > size:
                size, at = n, i - back - 1
        if size < 3:
            literal.append(data[i])
            i += 1
            continue
        flush()
        length = size - 2
        out.append((min(length, 7) << 5) | (at >> 8))
        if length >= 7:
            out.append(length - 7)
        out.append(at & 255)
        i += size
    flush()
    return bytes(out)


def pcd(data: str = "ascii", points: Any = VERTICES, *, size: int = 4, **lines: str) -> bytes:
    """A PCD file with a field of two values before z, and one after it."""
    n = len(points)
    header = {
        "VERSION": "0.7",
        "FIELDS": "x y pair z rgb",
        "SIZE": f"{size} {size} 2 {size} 4",
        "TYPE": "F F U F I",
        "COUNT": "1 1 2 1 1",
        "WIDTH": str(n),
        "HEIGHT": "1",
        "VIEWPOINT": "0 0 0 1 0 0 0",
        "POINTS": str(n),
        "DATA": data,
    } | lines
    text = "# .PCD v0.7\n" + "".join(f"{k} {v}\n" for k, v in header.items() if v is not None)
    kind = np.dtype([("x", f"<f{size}"), ("y", f"<f{size}"), ("pair", "<u2", 2), ("z", f"<f{size}"), ("rgb", "<i4")])
    table = np.zeros(n, dtype=kind)
    table["x"], table["y"], table["z"] = np.asarray(points, float).T
    table["pair"], table["rgb"] = 5, -1
    if data == "ascii":
        return (
            text + "".join(f"{x!r} {y!r} 5 5 {z!r} -1\n" for x, y, z in np.asarray(points, float).tolist())
        ).encode()
    if data == "binary":
        return text.encode() + table.tobytes()
    body = b"".join(table[name].tobytes() for name in kind.names or ())
    packed = lzf(body)
    return text.encode() + struct.pack("<2I", len(packed), len(body)) + packed


def _with(vertex: int, value: float) -> Any:
    out = VERTICES.copy()
    out[vertex, 1] = value
    return out


def _changed(path: str, value: Any) -> Any:
    """A change of one value of a GLB's JSON, named like nodes.2.mesh; None removes it."""

    def change(content: Any) -> None:
        *steps, last = (int(s) if s.isdigit() else s for s in path.split("."))
        for step in steps:
            content = content[step]
        if value is None:
            del content[last]
        else:
            content[last] = value

    return change


def broken() -> Iterator[tuple[str, bytes, str]]:
    """(name, content, what the error has to say) of files that cannot be used."""
    for order in ("ascii", "<", ">"):
        yield f"{order} cut off in the vertices.ply", ply(order)[: -160 if order == "ascii" else -100], "cut off"
        yield f"{order} cut off in the faces.ply", ply(order)[:-9], "cut off|3 or more"
        yield f"{order} 10^9 vertices.ply", ply(order, count=10**9), "1000000000 are announced"
        yield f"{order} fewer vertices than there are.ply", ply(order, count=3), "more|expected|out of|list|announced"
        yield f"{order} NaN.ply", ply(order, vertices=_with(2, NAN)), "number 2"
        yield f"{order} infinite.ply", ply(order, vertices=_with(1, INF)), "not finite"
        yield f"{order} no vertices.ply", ply(order, vertices=VERTICES[:0], faces=[]), "no vertices"
        yield f"{order} face out of range.ply", ply(order, faces=[[0, 1, 4]]), "vertices 0 to 3, got .0, 1, 4"
        yield f"{order} face of two.ply", ply(order, faces=[[0, 1]]), "3"
        yield f"{order} something behind.ply", ply(order) + b"1 2 3\n", "more"
    yield "negative index.ply", ply("<", faces=[[0, 1, -1]]), "vertices 0 to 3"
    yield "text for a number.ply", ply().replace(b"255 0.5", b"255 half"), ":20: vertex: expected 3 numbers"
    yield "too few numbers.ply", ply().replace(b" 3 -0.125", b""), "vertex"
    yield "empty.ply", b"", "is empty"
    yield "only the magic.ply", b"ply\n", "end_header"
    yield "no format.ply", ply().replace(b"format ascii 1.0\n", b""), 'no line "format"'
    yield "another format.ply", ply().replace(b"format ascii 1.0", b"format utf8 1.0"), ":2: expected format"
    yield "negative count.ply", ply().replace(b"element vertex 4", b"element vertex -4"), ":6: element vertex"
    yield "count of 10^30.ply", ply().replace(b"element vertex 4", b"element vertex 1" + b"0" * 30), "whole number"
    yield "two elements of one name.ply", ply().replace(b"element thing 2", b"element vertex 2"), "declared twice"
    yield "no z.ply", ply().replace(b" z\n", b" w\n"), "x, y and z"
    yield "list of vertices.ply", ply().replace(b"property float x", b"property list int float x"), "x, y and z"
    yield "list with a float length.ply", ply().replace(b"list uchar", b"list float"), "whole number"
    yield "faces without a list.ply", ply().replace(b"list uchar int vertex_indices", b"int a"), "list of whole numbers"
    yield "unknown type.ply", ply().replace(b"uchar red", b"quaternion red"), ":7: expected format"
    yield "property of nothing.ply", ply().replace(b"element thing 2\n", b""), "expected format"
    yield "triangle strips.ply", ply().replace(b"element face", b"element tristrips"), "strips"
    yield "header without an end.ply", b"ply\n" + b"comment x\n" * 20000, "end_header"
    yield "huge list.ply", ply("<").replace(b"list uchar int", b"list uint int"), "element face|cut off"

    yield "cut off.stl", stl_binary()[:-20], "cut off"
    yield "announces none.stl", stl_binary(count=0), "announces 0"
    yield "announces 10^9.stl", stl_binary(count=10**9), "1000000000 triangles"
    yield "too short.stl", b"\0" * 40, "too few"
    yield "no triangles.stl", stl_binary(faces=FACES[:0]), "no corners"
    yield "NaN.stl", stl_binary(_with(0, NAN)), "not finite"
    yield "binary that begins with solid, cut off.stl", stl_binary(start=b"solid x")[:-1], ":1: |cut off"
    yield "ascii cut off.stl", stl_ascii()[:-60], "cut off|expected a line"
    yield "ascii without its last line.stl", stl_ascii().replace(b"endsolid one\n", b""), ":29: .*cut off"
    yield "ascii of two vertices.stl", stl_ascii(faces=FACES[:, :2]), ":6: expected a line .vertex"
    yield "ascii with text.stl", stl_ascii().replace(b"0.125", b"deep"), "vertex: expected 3 numbers"
    yield "ascii infinite.stl", stl_ascii(_with(1, INF)), "not finite"
    yield "ascii of nothing.stl", b"solid\nendsolid\n", "no corners"

    yield "face out of range.obj", obj() + b"f 1 2 9\n", "vertices 0 to 3, got .0, 1, 8"
    yield "face 0.obj", obj() + b"f 0 1 2\n", ":12: face"
    yield "negative too far.obj", obj() + b"f -1 -2 -9\n", ":12: face"
    yield "face of two.obj", obj() + b"f 1 2\n", ":12: face"
    yield "face of text.obj", obj() + b"f a b c\n", ":12: face"
    yield "vertex of two numbers.obj", obj() + b"v 1 2\n", ":12: vertex"
    yield "NaN.obj", obj(_with(3, NAN)), "number 3"
    yield "no vertices.obj", b"# nothing\n", "no vertices"
    yield "not a statement.obj", b"hello world\n", ":1: no statement"
    yield "bytes.obj", bytes(range(256)), "no statement"

    yield "cut off.glb", glb()[:-4], "bytes, the header says"
    yield "version 1.glb", glb()[:4] + b"\1\0\0\0" + glb()[8:], "version 2"
    yield "not JSON.glb", glb_of(b"{", b"\0" * 4), "cannot be read"
    yield "not an object.glb", glb_of(b"[]", b"\0" * 4), "keys and values"
    yield "deep.glb", glb_of(b"[" * 100000 + b"]" * 100000, b""), "cannot be read"
    yield "NaN in JSON.glb", glb(change=_changed("nodes.1.scale", [NAN, 1.0, 1.0])), "NaN"
    yield "short.glb", b"glTF\2\0\0\0", "begins with"
    yield "JSON longer than the file.glb", glb()[:12] + b"\xff\xff\xff\x7f" + glb()[16:], "JSON chunk"
    for path, value, said in (
        ("nodes.2.mesh", 5, "meshes.5., which does not exist"),
        ("nodes.2.mesh", True, "does not exist"),
        ("nodes.2.children", [1], "two parents"),
        ("nodes.0.children", [2], "two parents"),
        ("nodes.0.children", 3, "children: expected a list"),
        ("nodes.0", 3, "keys and values"),
        ("scenes.0.nodes", [99], "does not exist"),
        ("nodes.1.scale", [1.0, 2.0], "3 finite numbers"),
        ("nodes.1.translation", [1e300, 0, 0], "finite"),
        ("nodes.2.rotation", [0, 0, 0, 0], "unit quaternion"),
        ("accessors.0.count", 10**9, "whole number"),
        ("accessors.0.count", 5, "beyond"),
        ("accessors.0.count", -1, "whole number"),
        ("accessors.0.type", "VEC2", "VEC3"),
        ("accessors.0.componentType", 5120, "component type"),
        ("accessors.0.bufferView", None, "sparse or compressed"),
        ("accessors.0.sparse", {}, "sparse"),
        ("accessors.0.byteOffset", 40, "beyond"),
        ("accessors.1.count", 11, "do not make triangles"),
        ("bufferViews.0.byteStride", 4, "beyond"),
        ("bufferViews.0.byteLength", 10**6, "whole number|beyond"),
        ("buffers.0.uri", "../../etc/passwd", "in the file itself"),
        ("meshes.0.primitives.0.mode", 5, "mode 5"),
        ("meshes.0.primitives.0.attributes", {}, "accessors.None"),
        ("meshes.0.primitives.0", None, "no vertices"),
        ("extensionsRequired", ["KHR_draco_mesh_compression"], "KHR_draco"),
    ):
        yield f"{path} is {str(value)[:20].replace('/', '-')}.glb", glb(change=_changed(path, value)), said
    yield "index out of range.glb", glb(faces=[[0, 1, 200]]), "vertices 0 to 3"
    yield "vertices not finite.glb", glb(_with(1, NAN)), "not finite"

    for data in ("ascii", "binary", "binary_compressed"):
        yield f"{data} NaN.pcd", pcd(data, _with(1, NAN)), "number 1"
        yield f"{data} cut off.pcd", pcd(data)[:-20], "cut off|follow"
        yield f"{data} announces too many.pcd", pcd(data, WIDTH="9", POINTS="9"), "9|announced"
        yield f"{data} 10^9.pcd", pcd(data, WIDTH="1000000000", POINTS="1000000000"), "1000000000 are announced"
        yield f"{data} nothing.pcd", pcd(data, VERTICES[:0]), "no points"
        yield f"{data} something behind.pcd", pcd(data) + b"1 2 5 5 3 -1\n", "more|follow"
    yield "no DATA.pcd", pcd(DATA=None), "DATA"  # type: ignore[arg-type]
    yield "no FIELDS.pcd", pcd(FIELDS=None), "FIELDS"  # type: ignore[arg-type]
    yield "no z.pcd", pcd(FIELDS="x y pair w rgb"), "x, y and z"
    yield "x twice.pcd", pcd(FIELDS="x y pair z x"), "each once"
    yield "too few sizes.pcd", pcd(SIZE="4 4 2 4"), "SIZE: expected one value for each of 5"
    yield "size 3.pcd", pcd(SIZE="3 4 2 4 4"), "a size it has"
    yield "type Q.pcd", pcd(TYPE="Q F U F I"), "type F, I or U"
    yield "count 0.pcd", pcd(COUNT="1 1 0 1 1"), "COUNT"
    yield "count of x.pcd", pcd(COUNT="2 1 1 1 1"), "COUNT of x"
    yield "points are not width x height.pcd", pcd(HEIGHT="2"), "POINTS says 4"
    yield "negative width.pcd", pcd(WIDTH="-4"), "WIDTH"
    yield "two widths.pcd", pcd(WIDTH="4 4"), "one whole number"
    yield "another DATA.pcd", pcd(DATA="zip"), "ascii, binary or binary_compressed"
    yield "unknown key.pcd", pcd().replace(b"VIEWPOINT", b"COLOUR"), "COLOUR"
    yield "text for a number.pcd", pcd().replace(b"0.25", b"half"), ":14: point"
    damaged = bytearray(pcd("binary_compressed"))
    damaged[damaged.index(b"compressed\n") + 19] = 255
    yield "damaged.pcd", bytes(damaged), "damaged"

    yield "ply with another name.stl", ply("<"), "rename"
    yield "glb with another name.obj", glb(), "rename"
    yield "picture.png", b"\x89PNG", "ending"
    yield "no ending", b"x", "ending"


WHOLE = {
    "ascii.ply": ply(),
    "little.ply": ply("<"),
    "big.ply": ply(">"),
    "double.ply": ply("<", kind="double"),
    "binary.stl": stl_binary(),
    "solid.stl": stl_binary(start=b"solid as written by some"),
    "ascii.stl": stl_ascii(),
    "one.obj": obj(),
    "one.glb": glb(),
    "ascii.pcd": pcd(),
    "binary.pcd": pcd("binary"),
    "double.pcd": pcd("binary", size=8),
    "packed.pcd": pcd("binary_compressed", np.tile(VERTICES, (50, 1))),
}
