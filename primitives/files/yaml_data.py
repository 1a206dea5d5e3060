"""Plain data from a YAML parser's events, with the line where each value stands, within bounds."""

from collections.abc import Iterator
from typing import Any

import yaml

from primitives.errors import InputError
from primitives.files.document import MAX_PROBLEMS, Mark, Problem, ValuePath, in_words
from primitives.files.yaml_scalars import resolve

MAX_DEPTH = 32
MAX_ITEMS = 1000
"""In one list, or keys in one place."""
MAX_VALUES = 50_000


class UnreadableError(Exception):
    """Nothing more can be read; the problems say why."""


class Builder:
    """Plain data from the parser's events, without building the parser's own tree.

    Attributes
    ----------
    marks : where each value stands.
    problems : what is wrong so far.
    """

    def __init__(self, events: Iterator[Any], file: str):
        self.marks: dict[ValuePath, Mark] = {(): Mark(file, 1)}
        self.problems: list[Problem] = []
        self._events, self._file, self._values = events, file, 0

    def _report(self, event: Any, path: ValuePath, message: str) -> None:
        field = in_words(path)
        mark = Mark(self._file, event.start_mark.line + 1)
        self.problems.append(Problem(mark, path, f"{field}: {message}" if field else message))
        if len(self.problems) >= MAX_PROBLEMS:
            raise UnreadableError

    def _stop(self, event: Any, message: str, path: ValuePath = ()) -> None:
        self._report(event, path, message)
        raise UnreadableError

    def document(self) -> Any:
        """The data; raises UnreadableError, and what the parser raises."""
        next(self._events)
        first = next(self._events)
        data = None if isinstance(first, yaml.StreamEndEvent) else self._value(next(self._events), ())
        if data is None and not self.problems:
            self.problems.append(Problem(self.marks[()], (), "the file is empty; expected keys and values"))
            raise UnreadableError
        for event in self._events:
            if isinstance(event, yaml.DocumentStartEvent):
                self._stop(event, "a second document begins here; put it in a file of its own")
        return data

    def _value(self, event: Any, path: ValuePath) -> Any:
        self._values += 1
        if self._values > MAX_VALUES:
            self._stop(event, f"more than {MAX_VALUES} values, the most that are read; is it the right file?")
        if len(path) > MAX_DEPTH:
            self._stop(event, f"lists and keys are nested more than {MAX_DEPTH} deep; flatten them")
        self.marks.setdefault(path, Mark(self._file, event.start_mark.line + 1))
        if isinstance(event, yaml.AliasEvent):
            return self._report(event, path, f"alias *{event.anchor} is not allowed; write the value out")
        if event.anchor is not None:
            self._report(event, path, f"anchor &{event.anchor} is not allowed; remove it")
        if event.tag is not None:
            self._report(event, path, f"tag {event.tag[:40]} is not allowed; remove it")
        if isinstance(event, yaml.ScalarEvent):
            return self._scalar(event, path)
        return self._list(path) if isinstance(event, yaml.SequenceStartEvent) else self._mapping(path)

    def _scalar(self, event: Any, path: ValuePath) -> Any:
        if event.style:
            return event.value
        try:
            return resolve(event.value)
        except InputError as error:
            return self._report(event, path, str(error))

    def _check_size(self, event: Any, path: ValuePath, size: int) -> None:
        if size >= MAX_ITEMS:
            self._stop(event, f"more than {MAX_ITEMS} items, the most that are read", path)

    def _list(self, path: ValuePath) -> list[Any]:
        out: list[Any] = []
        while not isinstance(event := next(self._events), yaml.SequenceEndEvent):
            self._check_size(event, path, len(out))
            out.append(self._value(event, (*path, len(out))))
        return out

    def _mapping(self, path: ValuePath) -> dict[str, Any]:
        out: dict[str, Any] = {}
        while not isinstance(event := next(self._events), yaml.MappingEndEvent):
            self._check_size(event, path, len(out))
            if not isinstance(event, yaml.ScalarEvent) or not (event.value or event.style):
                self._stop(event, "expected a text as key", path)
            key = event.value
            if event.anchor is not None or event.tag is not None:
                self._report(event, (*path, key), "anchors and tags are not allowed; remove what stands before the key")
            if key in out:
                first = self.marks[(*path, key)].line
                self._report(event, (*path, key), f"this key stands in line {first} already; keep one of the two")
                self._value(next(self._events), (*path, key))
            else:
                self.marks[(*path, key)] = Mark(self._file, event.start_mark.line + 1)
                out[key] = self._value(next(self._events), (*path, key))
        return out
