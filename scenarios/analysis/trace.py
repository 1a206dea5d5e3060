"""The trace of a run: every cycle's record in an append-only MCAP file that survives a kill.

A message on /cycles is a block of consecutive records, little-endian float64, row by row; one on /events is a change of
state, as JSON. The schema names the columns, the
metadata record "run" holds the scene, the seed and the versions as JSON. Blocks are written unchunked and flushed, so
what a killed run leaves behind loads up to its last complete block.
"""

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self

import numpy as np
from mcap.exceptions import McapError
from mcap.records import Channel, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from primitives.checks import Array, known
from primitives.errors import FileError, InputError

SCHEMA = "active_constraints.Cycles"
EVENT_SCHEMA = "active_constraints.Event"
EVENT = json.dumps(
    {
        "type": "object",
        "properties": {"t": {"type": "number"}, "state": {"type": "string"}, "reason": {"type": "string"}},
    }
)


class Event(NamedTuple):
    """A change of the controller's state.

    Attributes
    ----------
    t : seconds. state : RUN, DEGRADED, HOLD or FAULT. reason : in words; empty for RUN.
    """

    t: float
    state: str
    reason: str


def labels(headers: Sequence[Mapping[str, Any]]) -> list[str]:
    """What tells several runs apart: the scene, and the solver and coordination where they are not the same for all."""
    telling = [key for key in ("coordination", "solver") if len({header.get(key) for header in headers}) > 1]
    return [
        " ".join([header["scene"], *(str(header[key]) for key in telling if header.get(key))]) for header in headers
    ]


class TraceWriter:
    """Writes a trace block by block; use it in a ``with`` statement.

    Parameters
    ----------
    path : of the file; it is replaced.
    columns : {quantity: slice of the record}.
    header : JSON-able facts on the run.
    """

    def __init__(self, path: Path, columns: Mapping[str, slice], header: Mapping[str, Any]):
        try:
            self._file = path.open("wb")
        except OSError as error:
            raise FileError(str(path), f"cannot be written ({error})") from None
        self._writer = Writer(self._file, use_chunking=False)
        self._writer.start(profile="", library="active-constraints")
        description = {name: [place.start, place.stop] for name, place in columns.items()}
        schema = self._writer.register_schema(SCHEMA, "jsonschema", json.dumps({"columns": description}).encode())
        self._channel = self._writer.register_channel("/cycles", "float64le", schema)
        self._writer.add_metadata("run", {"header": json.dumps(header)})
        plain = self._writer.register_schema(EVENT_SCHEMA, "jsonschema", EVENT.encode())
        self._events = self._writer.register_channel("/events", "json", plain)
        self._sequence = 0
        self._file.flush()

    def write(self, records: Array) -> None:
        """Append records (k, width) and hand them to the operating system."""
        if len(records) == 0:
            return
        self._add(self._channel, float(records[0, 0]), np.ascontiguousarray(records, dtype="<f8").tobytes())

    def note(self, event: Event) -> None:
        """Append that the state changed, and why."""
        self._add(self._events, event.t, json.dumps(event._asdict()).encode())

    def _add(self, channel: int, t: float, data: bytes) -> None:
        stamp = max(0, round(t * 1e9))
        try:
            self._writer.add_message(channel, stamp, data, stamp, self._sequence)
            self._file.flush()
        except OSError as error:
            raise FileError(self._file.name, f"the trace cannot be continued ({error})") from None
        self._sequence += 1

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
    events : changes of the controller's state, in order.
    complete : False where the file ends in the middle, as after a kill.
    """

    header: Mapping[str, Any]
    columns: Mapping[str, slice]
    records: Array
    events: tuple[Event, ...] = ()
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
        events: list[Event] = []
        cycles = -1
        complete = False
        try:
            with Path(path).open("rb") as stream:
                for record in StreamReader(stream).records:
                    if isinstance(record, Schema) and record.name == SCHEMA:
                        described = json.loads(record.data)["columns"]
                        columns = {name: slice(*place) for name, place in described.items()}
                    elif isinstance(record, Metadata) and record.name == "run":
                        header = json.loads(record.metadata["header"])
                    elif isinstance(record, Channel) and record.topic == "/cycles":
                        cycles = record.id
                    elif isinstance(record, Message) and record.channel_id == cycles:
                        blocks.append(record.data)
                    elif isinstance(record, Message):
                        events.append(Event(**json.loads(record.data)))
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
        return cls(header, columns, records, tuple(events), complete)

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
