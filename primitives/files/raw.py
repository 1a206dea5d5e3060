"""What the readers of geometry files share: bytes, counts, tables of numbers and faces, each checked."""

import re
import stat
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from primitives.checks import Array
from primitives.errors import FileError
from primitives.files.document import printable

MAX_BYTES = 128 * 1024 * 1024
"""A larger file is refused; it would hold millions of triangles."""

MAX_POLYGONS = 500_000
"""Faces of different numbers of corners that are read one by one."""

_SHOWN = 60


class Raw:
    """The bytes of a file, and its name for errors.

    Raises
    ------
    FileError : missing, no ordinary file, empty, or larger than `MAX_BYTES`.
    """

    def __init__(self, path: str | Path):
        self.name = printable(str(path))
        try:
            mode = Path(path).stat().st_mode
            if not stat.S_ISREG(mode):
                self.refuse(f"is {'a folder' if stat.S_ISDIR(mode) else 'no ordinary file'}; name a file of geometry")
            with Path(path).open("rb") as stream:
                self.data = stream.read(MAX_BYTES + 1)
        except FileNotFoundError:
            self.refuse("there is no such file; check the path")
        except (OSError, ValueError) as error:
            if isinstance(error, FileError):
                raise
            self.refuse(f"cannot be read ({getattr(error, 'strerror', None) or error}); check the path")
        if not self.data:
            self.refuse("is empty")
        if len(self.data) > MAX_BYTES:
            self.refuse(f"is larger than {MAX_BYTES // 2**20} MiB, the most that is read; is it the right file?")

    def refuse(self, message: str, line: int = 0) -> NoReturn:
        """Raise a FileError about this file, or one of its lines (from 1)."""
        raise FileError(f"{self.name}:{line}" if line else self.name, message) from None

    def shown(self, text: bytes) -> str:
        """Text from the file as an error may show it."""
        start = text[:_SHOWN].decode("ascii", "backslashreplace").strip()
        return printable(start) + (" ..." if len(text) > _SHOWN else "")

    def count(self, text: bytes, what: str, line: int, *, packed: bool = False) -> int:
        """A whole number >= 0 of a header, no larger than the file or, for packed data, than any file may be."""
        most = MAX_BYTES if packed else len(self.data)
        if not re.fullmatch(rb"[0-9]{1,18}", text):
            self.refuse(f"{what}: expected a whole number, got {self.shown(text)!r}", line)
        if int(text) > most:
            self.refuse(f"{what}: {int(text)} are announced, but the file has {len(self.data)} bytes", line)
        return int(text)

    def table(self, lines: Sequence[bytes], columns: Sequence[int], numbers: Sequence[int], what: str) -> Array:
        """Some columns of lines of numbers, (len(lines), len(columns)); `numbers` are the lines' own, from 1."""
        try:
            return np.loadtxt(lines, usecols=tuple(columns), ndmin=2, comments=None).reshape(-1, len(columns))
        except (ValueError, OverflowError, UnicodeDecodeError):
            for line, number in zip(lines, numbers, strict=True):
                words = line.split()
                if not _are_numbers(words, columns):
                    self.refuse(f"{what}: expected {len(columns)} numbers, got {self.shown(line)!r}", number)
            self.refuse(f"{what}: not a table of numbers")

    def part(self, start: int, dtype: Any, count: int, what: str) -> np.ndarray:
        """`count` records of bytes from `start` on; refuses what is not there before it takes any memory."""
        size = np.dtype(dtype).itemsize
        if start + count * size > len(self.data):
            self.refuse(
                f"{what}: {count} of {size} bytes each are announced, but only {max(len(self.data) - start, 0)} "
                "bytes are left; is the file cut off?"
            )
        return np.frombuffer(self.data, dtype=dtype, count=count, offset=start)

    def finite(self, points: np.ndarray, what: str) -> Array:
        """Points (n, 3) as float64, refused where there are none or one is not finite."""
        if not len(points):
            self.refuse(f"has no {what}")
        out = np.ascontiguousarray(points, dtype=np.float64)
        wrong = np.flatnonzero(~np.isfinite(out).all(axis=1))
        if len(wrong):
            self.refuse(
                f"{len(wrong)} of {len(out)} {what} are not finite; the first is number {wrong[0]}, "
                f"{out[wrong[0]].tolist()}. Remove them"
            )
        return out

    def faces(self, indices: np.ndarray, vertices: int) -> np.ndarray:
        """Polygons (m, n) as triangles (m (n - 2), 3) int64; refuses an index that no vertex has."""
        wrong = np.flatnonzero(((indices < 0) | (indices >= vertices)).any(axis=1))
        if len(wrong):
            self.refuse(f"face {wrong[0]}: expected vertices 0 to {vertices - 1}, got {indices[wrong[0]].tolist()[:8]}")
        out = indices.astype(np.int64)
        n = out.shape[1]
        fan = np.array([[0, i, i + 1] for i in range(1, n - 1)])
        return np.ascontiguousarray(out[:, fan].reshape(-1, 3))

    def polygons(self, lists: Sequence[np.ndarray], vertices: int) -> np.ndarray:
        """Polygons of different numbers of corners as triangles."""
        parts = [np.zeros((0, 3), dtype=np.int64)]
        for number, corners in enumerate(lists):
            if len(corners) < 3:
                self.refuse(f"face {number}: expected at least 3 vertices, got {len(corners)}")
            parts.append(self.faces(corners[None, :], vertices))
        return np.concatenate(parts)

    def few_polygons(self, count: int) -> None:
        """Refuse to read so many polygons one by one."""
        if count > MAX_POLYGONS:
            self.refuse(f"has {count} faces of different numbers of corners, more than {MAX_POLYGONS}; triangulate it")


def _are_numbers(words: Sequence[bytes], columns: Sequence[int]) -> bool:
    try:
        return all(isinstance(float(words[c]), float) for c in columns)
    except (ValueError, IndexError):
        return False
