"""The trace of a run: every cycle's record in an append-only MCAP file that survives a kill.

Each message is a block of consecutive records, little-endian float64, row by row. The schema names the columns, the
metadata record "run" holds the scene, the seed and the versions as JSON. Blocks are written unchunked and flushed, so
what a killed run leaves behind loads up to its last complete block.
"""

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from mcap.exceptions import McapError
from mcap.records import Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from primitives.checks import Array, known
from primitives.errors import FileError, InputError

SCHEMA = "active_constraints.Cycles"


class TraceWriter:
    """Writes a trace block by block; use it in a ``with`` statement.

    Parameters
    ----------
    path : of the file; it is replaced.
    columns : {quantity: slice of the record}.
    header : JSON-able facts on the run.
    """

    def __init__(self, path: Path, columns: Mapping[str, slice], header: Mapping[str, Any]):
        self._file = path.open("wb")
        self._writer = Writer(self._file, use_chunking=False)
        self._writer.start(profile="", library="active-constraints")
        description = {name: [place.start, place.stop] for name, place in columns.items()}
        schema = self._writer.register_schema(SCHEMA, "jsonschema", json.dumps({"columns": description}).encode())
        self._channel = self._writer.register_channel("/cycles", "float64le", schema)
        self._writer.add_metadata("run", {"header": json.dumps(header)})
        self._sequence = 0
        self._file.flush()

    def write(self, records: Array) -> None:
        """Append records (k, width) and hand them to the operating system."""
        if len(records) == 0:
            return
        stamp = max(0, round(float(records[0, 0]) * 1e9))
        self._writer.add_message(
            self._channel, stamp, np.ascontiguousarray(records, dtype="<f8").tobytes(), stamp, self._sequence
        )
        self._sequence += 1
        self._file.flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.close()


@dataclass(frozen=True)
class Trace:
    """Records of a run as arrays: ``trace["margin"]`` is (cycles, constraints).

    Attributes
    ----------
    header : scene, robot, solver, period, guard, seed, versions, names of joints and constraints.
    columns : {quantity: slice of the record}; see `vfi.record.columns`.
    records : (cycles, width).
    complete : False where the file ends in the middle, as after a kill.
    """

    header: Mapping[str, Any]
    columns: Mapping[str, slice]
    records: Array
    complete: bool = True

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a trace; a truncated file gives what is complete of it.

        Raises
        ------
        FileError : missing, or not a trace of this project.
        """
        header: Any = None
        columns: dict[str, slice] = {}
        blocks: list[bytes] = []
        complete = False
        try:
            with Path(path).open("rb") as stream:
                for record in StreamReader(stream).records:
                    if isinstance(record, Schema) and record.name == SCHEMA:
                        described = json.loads(record.data)["columns"]
                        columns = {name: slice(*place) for name, place in described.items()}
                    elif isinstance(record, Metadata) and record.name == "run":
                        header = json.loads(record.metadata["header"])
                    elif isinstance(record, Message):
                        blocks.append(record.data)
                complete = True
        except OSError as error:
            raise FileError(str(path), f"cannot be read ({error})") from None
        except (McapError, ValueError, EOFError, struct.error) as error:
            if header is None:
                raise FileError(str(path), f"not a trace of this project ({type(error).__name__}: {error})") from None
        if header is None or not columns:
            raise FileError(str(path), "not a trace of this project: it names no columns")
        width = max(place.stop for place in columns.values())
        whole = [block for block in blocks if len(block) % (8 * width) == 0]
        records = np.frombuffer(bytearray().join(whole), dtype="<f8").reshape(-1, width)
        return cls(header, columns, records, complete)

    def __getitem__(self, quantity: str) -> Array:
        """A quantity of every cycle, (cycles, size); (cycles,) where it is a single number. Raises UnknownNameError."""
        place = self.columns[known("quantity", quantity, self.columns)]
        values = self.records[:, place]
        return values[:, 0] if place.stop - place.start == 1 and quantity not in _ALWAYS_WIDE else values

    def margin(self, name: str) -> Array:
        """Margin of one constraint, (cycles,), metres or radians; raises UnknownNameError."""
        names = list(self.header["constraints"])
        return self.records[:, self.columns["margin"]][:, names.index(known("constraint", name, names))]

    @property
    def t(self) -> Array:
        """(cycles,) seconds."""
        if len(self.records) == 0:
            raise InputError("the trace has no cycles")
        return self["t"]


_ALWAYS_WIDE = frozenset({"q", "qdot", "reference", "pose", "error", "distance", "margin", "slack", "multiplier"})
