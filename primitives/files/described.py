"""What an editor shows of a mapping in a file: a JSON Schema with the words of the docstring of what it declares."""

import re
from inspect import cleandoc
from typing import Any

_SECTION = re.compile(r"^(?:Attributes|Parameters)\n-+\n(.*?)(?:\n\n|\Z)", re.MULTILINE | re.DOTALL)
_ENTRY = re.compile(r"(?:^|(?<=\. ))(\w+(?:, \w+)*) : ")

_NOTHING = {"type": "null"}


def summary(thing: Any) -> str:
    """First paragraph of a docstring in one line; empty where there is none."""
    return " ".join(_doc(thing).split("\n\n")[0].split())


def _doc(thing: Any) -> str:
    """The docstring of its own, not what `getdoc` finds in a base class."""
    return cleandoc(thing.__doc__ or "")


def described_names(thing: Any) -> dict[str, str]:
    """{name: what a docstring says of it} of the names in its sections Attributes and Parameters.

    Names that share an entry share its text: ``first, second : the elements``.
    """
    out: dict[str, str] = {}
    for section in _SECTION.findall(_doc(thing)):
        for entry in re.sub(r"\n +", " ", section).split("\n"):
            _, *found = _ENTRY.split(entry)
            for names, text in zip(found[::2], found[1::2], strict=True):
                out |= {name: text.strip() for name in names.split(", ")}
    return out


def describe(schema: dict[str, Any], things: list[Any]) -> None:
    """Put words into the JSON Schema of a mapping, and take out the titles that repeat its keys.

    A value that may be left empty is checked as what it is where it is not, so that a mistake is shown at its place.

    Parameters
    ----------
    things : what the mapping declares; the first that knows of a key describes it.
    """
    if words := next((words for thing in things if (words := summary(thing))), ""):
        schema["description"] = words
    known: dict[str, str] = {}
    for thing in reversed(things):
        known |= described_names(thing)
    for name, value in schema.get("properties", {}).items():
        value.pop("title", None)
        if name in known:
            value["description"] = known[name]
        if value.get("default", 0) in (None, "", {}):
            del value["default"]
        if value.get("anyOf", [])[1:] == [_NOTHING]:
            value |= {"if": _NOTHING, "else": value.pop("anyOf")[0]}
