"""PCD files of the Point Cloud Library: ascii, binary and binary_compressed. The viewpoint is not applied."""

from typing import NamedTuple

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.files.raw import MAX_BYTES, Raw

_KEYS = (b"VERSION", b"FIELDS", b"SIZE", b"TYPE", b"COUNT", b"WIDTH", b"HEIGHT", b"VIEWPOINT", b"POINTS", b"DATA")
_KINDS = {b"F": "f", b"I": "i", b"U": "u"}
_SIZES = {"f": (4, 8), "i": (1, 2, 4, 8), "u": (1, 2, 4, 8)}
_MAX_HEADER, _MAX_LINES, _MAX_FIELDS, _MAX_COUNT = 65_536, 100, 256, 4096


class _Header(NamedTuple):
    names: list[bytes]
    types: list[str]
    counts: list[int]
    points: int
    data: bytes
    lines: int
    end: int

    @property
    def record(self) -> np.dtype[np.void]:
        """One point, its fields called f0, f1 ..."""
        shapes = [(c,) if c > 1 else () for c in self.counts]
        return np.dtype([(f"f{i}", t, s) for i, (t, s) in enumerate(zip(self.types, shapes, strict=True))])


def read_pcd(raw: Raw) -> Array:
    """Points (N, 3).

    Raises
    ------
    FileError : whatever is wrong with the file; points that are not finite included.
    """
    header = _header(raw)
    xyz = [header.names.index(name) for name in (b"x", b"y", b"z")]
    if header.data == b"ascii":
        first = np.concatenate([[0], np.cumsum(header.counts)])
        lines = raw.data[header.end :].splitlines()
        kept = [(line, number) for number, line in enumerate(lines, header.lines + 1) if line.strip()]
        if len(kept) != header.points:
            raw.refuse(f"POINTS: {header.points} are announced, {len(kept)} lines follow; is the file cut off?")
        if not kept:
            return raw.finite(np.zeros((0, 3)), "points")
        texts, numbers = [line for line, _ in kept], [number for _, number in kept]
        raw.table(texts, [int(first[-1]) - 1], numbers, "a point with all its fields")
        return raw.finite(raw.table(texts, [int(first[i]) for i in xyz], numbers, "point"), "points")
    if header.data == b"binary":
        records = raw.part(header.end, header.record, header.points, "points")
        if len(raw.data) > header.end + records.nbytes:
            raw.refuse(f"{len(raw.data) - header.end - records.nbytes} bytes more than the header announces")
        return raw.finite(np.stack([records[f"f{i}"].astype(np.float64) for i in xyz], axis=-1), "points")
    return raw.finite(_compressed(raw, header, xyz), "points")


def _compressed(raw: Raw, header: _Header, xyz: list[int]) -> np.ndarray:
    """x, y and z of a file whose fields lie one after the other, compressed with LZF."""
    packed, size = (int(n) for n in raw.part(header.end, "<u4", 2, "sizes of the compressed data"))
    expected = header.record.itemsize * header.points
    if size != expected or size > MAX_BYTES:
        raw.refuse(f"compressed data of {size} bytes, but {header.points} points are {expected} (at most {MAX_BYTES})")
    if header.end + 8 + packed != len(raw.data):
        raw.refuse(f"{packed} bytes of compressed data are announced, {len(raw.data) - header.end - 8} follow")
    out = np.zeros(size, dtype=np.uint8)
    if decompress(np.array(raw.part(header.end + 8, np.uint8, packed, "compressed data")), out) != size:
        raw.refuse("the compressed data are damaged")
    starts = [header.points * header.record.fields[f"f{i}"][1] for i in xyz]  # type: ignore[index]
    columns = [np.frombuffer(out, header.types[i], header.points, s) for i, s in zip(xyz, starts, strict=True)]
    return np.stack([c.astype(np.float64) for c in columns], axis=-1)


@compiled("int64(uint8[::1], uint8[::1])")
def decompress(packed: np.ndarray, out: np.ndarray) -> int:
    """Unpack LZF data, the format of M. Lehmann's liblzf; returns the bytes written, or -1 for damaged data.

    A control byte below 32 is followed by so many bytes and one; others hold the length and distance of a repetition.
    """
    i, o, n, room = 0, 0, packed.shape[0], out.shape[0]
    while i < n:
        control = int(packed[i])
        i += 1
        if control < 32:
            length = control + 1
            if i + length > n or o + length > room:
                return -1
            for _ in range(length):
                out[o] = packed[i]
                i += 1
                o += 1
            continue
        length = control >> 5
        if length == 7:
            if i >= n:
                return -1
            length += int(packed[i])
            i += 1
        if i >= n:
            return -1
        source = o - ((control & 31) << 8) - int(packed[i]) - 1
        i += 1
        length += 2
        if source < 0 or o + length > room:
            return -1
        for _ in range(length):
            out[o] = out[source]
            source += 1
            o += 1
    return o


def _header(raw: Raw) -> _Header:
    found: dict[bytes, tuple[list[bytes], int]] = {}
    at = 0
    for number in range(1, _MAX_LINES):
        newline = raw.data.find(b"\n", at, _MAX_HEADER)
        if newline < 0:
            break
        words = raw.data[at:newline].split()
        at = newline + 1
        if not words or words[0].startswith(b"#"):
            continue
        if words[0] not in _KEYS or words[0] in found:
            raw.refuse(
                f"expected each of {', '.join(k.decode() for k in _KEYS)} once, got {raw.shown(b' '.join(words))!r}",
                number,
            )
        found[words[0]] = (words[1:], number)
        if words[0] == b"DATA":
            break
    if b"DATA" not in found:
        raw.refuse('the header of a PCD file ends with a line "DATA ..."; there is none')
    return _checked(raw, found, at)


def _checked(raw: Raw, found: dict[bytes, tuple[list[bytes], int]], end: int) -> _Header:
    for key in (b"FIELDS", b"SIZE", b"TYPE", b"WIDTH", b"HEIGHT"):
        if key not in found:
            raw.refuse(f'the header has no line "{key.decode()}"')
    names, line = found[b"FIELDS"]
    if not 0 < len(names) <= _MAX_FIELDS or any(names.count(c) != 1 for c in (b"x", b"y", b"z")):
        raw.refuse("FIELDS: expected x, y and z, each once", line)
    found.setdefault(b"COUNT", ([b"1"] * len(names), line))
    for key in (b"SIZE", b"TYPE", b"COUNT"):
        if len(found[key][0]) != len(names):
            raw.refuse(f"{key.decode()}: expected one value for each of {len(names)} fields", found[key][1])
    types, counts = list[str](), list[int]()
    for i, name in enumerate(names):
        kind = _KINDS.get(found[b"TYPE"][0][i], "")
        size = raw.count(found[b"SIZE"][0][i], "SIZE", found[b"SIZE"][1])
        if size not in _SIZES.get(kind, ()):
            raw.refuse(f"field {raw.shown(name)}: expected type F, I or U and a size it has", found[b"TYPE"][1])
        types.append(f"<{kind}{size}")
        counts.append(raw.count(found[b"COUNT"][0][i], "COUNT", found[b"COUNT"][1]))
        if not 0 < counts[-1] <= _MAX_COUNT or (name in (b"x", b"y", b"z") and counts[-1] != 1):
            raw.refuse(f"COUNT of {raw.shown(name)}: expected 1 for x, y and z, and at most {_MAX_COUNT}", line)
    sizes = []
    for key in (b"WIDTH", b"HEIGHT", *([b"POINTS"] if b"POINTS" in found else [])):
        words, line = found[key]
        if len(words) != 1:
            raw.refuse(f"{key.decode()}: expected one whole number", line)
        sizes.append(raw.count(words[0], key.decode(), line, packed=found[b"DATA"][0] == [b"binary_compressed"]))
    if len(sizes) == 3 and sizes[0] * sizes[1] != sizes[2]:
        raw.refuse(f"WIDTH x HEIGHT is {sizes[0] * sizes[1]}, POINTS says {sizes[2]}")
    data, line = found[b"DATA"]
    if data not in ([b"ascii"], [b"binary"], [b"binary_compressed"]):
        raw.refuse("DATA: expected ascii, binary or binary_compressed", line)
    return _Header(names, types, counts, sizes[0] * sizes[1], data[0], line, end)
