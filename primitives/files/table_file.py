"""CSV files of numbers over time, read as hostile ones: errors name file, line and field."""

import csv
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from primitives.checks import Array
from primitives.errors import FileError

MOST_BYTES = 256 * 2**20
LONGEST_FIELD = 64
FARTHEST = 1e6
"""Size beyond which a number is not believed, SI."""


def read_table(path: str | Path, columns: tuple[str, ...]) -> Array:
    """(k, c) the numbers of a CSV file whose first line names its columns; the first one is a time that grows.

    Raises
    ------
    FileError : missing, too large, not text, another header, a field missing, too many or no finite number, a time
        that does not grow, or no records.
    """
    file = Path(path)
    try:
        if not file.is_file():
            raise FileError(str(path), "no such file")
        if file.stat().st_size > MOST_BYTES:
            raise FileError(str(path), f"{file.stat().st_size} bytes, expected at most {MOST_BYTES}")
        with file.open(encoding="utf-8", newline="") as stream:
            return _read(str(path), stream, columns)
    except OSError as error:
        raise FileError(str(path), f"cannot be read ({error})") from None
    except UnicodeDecodeError as error:
        raise FileError(str(path), f"is no text in UTF-8 ({error.reason})") from None
    except csv.Error as error:
        raise FileError(str(path), f"is no CSV ({error})") from None


def _read(path: str, stream: Iterable[str], columns: tuple[str, ...]) -> Array:
    rows: list[list[float]] = []
    reader = csv.reader(stream, strict=True)
    header = next(reader, None)
    if header is None or tuple(name.strip().lower() for name in header) != columns:
        got = "an empty file" if header is None else ",".join(header)[:80]
        raise FileError(f"{path}:1", f"expected the header {','.join(columns)}, got {got}")
    for row in reader:
        place = f"{path}:{reader.line_num}"
        if not row:
            continue
        if len(row) != len(columns):
            raise FileError(place, f"expected {len(columns)} fields, got {len(row)}")
        rows.append([_number(place, name, text) for name, text in zip(columns, row, strict=True)])
        if len(rows) > 1 and not rows[-1][0] > rows[-2][0]:
            raise FileError(place, f"{columns[0]}: expected more than {rows[-2][0]} s, got {rows[-1][0]}")
    if not rows:
        raise FileError(path, "has no records")
    return np.array(rows)


def _number(place: str, name: str, text: str) -> float:
    try:
        value = float(text) if len(text) <= LONGEST_FIELD else np.nan
    except ValueError:
        value = np.nan
    if not abs(value) <= FARTHEST:
        raise FileError(place, f"{name}: expected a number of size at most {FARTHEST:g}, got {text[:LONGEST_FIELD]!r}")
    return value
