"""Checking that a broken file is refused with one of our errors, and a source of broken files."""

import json
import re
import time
from copy import deepcopy

from hypothesis import strategies as st

from primitives.errors import FileError, InputError

FOREIGN = ("Traceback", "pydantic", "yaml.scanner", "yaml.parser", "errors.pydantic.dev", "value_error")


def problems(load, file):
    """(file name, line, message) of everything that loading a file refuses; a line without a place goes to its end."""
    try:
        load(file)
    except FileError as error:
        assert error.__cause__ is None
        assert error.__suppress_context__ or error.__context__ is None
        text = str(error)
    else:
        return []
    assert not any(word in text for word in FOREIGN), text
    found = [re.fullmatch(r"(?:.*?/)?([^/:]+\.yaml):(\d+): (.+)", line) for line in text.splitlines()]
    assert all(found), text
    return [(m[1], int(m[2]), m[3]) for m in found]


def changed(text, changes):
    """The text with lines replaced: {line number: new lines, or None to delete it}."""
    lines = text.splitlines()
    for number, new in changes.items():
        lines[number - 1] = new
    return "\n".join(line for line in lines if line is not None) + "\n"


SPLINTERS = (
    *"[]{}:,-#&*!|>'\"%@`?~\t\n\r\0\x07 ",
    *("- ", ": ", ".nan", "-.inf", "1e999", "<<: *a", "&a [*a]", "!!python/name:os.system", "---\n", "true", "null"),
    *("5 mm", "-1", "0", "world", "line", "\u2028", "\ufeff", "\ud800", "9" * 400, "a" * 300, "[" * 40, "? "),
)


@st.composite
def broken_texts(draw, text):
    """A valid text with one to six pieces cut out, doubled, moved or replaced by splinters."""
    for _ in range(draw(st.integers(1, 6))):
        a, b = sorted((draw(st.integers(0, len(text))), draw(st.integers(0, len(text)))))
        b = min(b, a + draw(st.sampled_from((0, 1, 3, 12, 80))))
        piece = draw(st.sampled_from((*SPLINTERS, "", text[a:b] * 2)))
        text = text[:a] + piece + text[b:]
    return text


@st.composite
def broken_data(draw, data):
    """Valid plain data with some values replaced by others, as JSON, which is YAML."""
    data = json.loads(json.dumps(data))
    other = st.sampled_from((None, True, -1, 0, 1e300, "x", "", "world", "line", [], {}, [1, 2, 3], {"kind": "point"}))
    for _ in range(draw(st.integers(1, 3))):
        at = data
        while True:
            if not isinstance(at, dict | list) or not at:
                break
            key = draw(st.sampled_from(sorted(at) if isinstance(at, dict) else range(len(at))))
            if not isinstance(at[key], dict | list) or draw(st.integers(0, 3)) == 0:
                at[key] = deepcopy(draw(other))
                break
            at = at[key]
    return json.dumps(data, indent=1)


def survives(load, file, text):
    """Loading the text gives something or one of our errors, within two seconds."""
    file.write_bytes(text.encode("utf-8", "surrogatepass"))
    began = time.perf_counter()
    try:
        load(file)
    except InputError as error:
        assert not any(word in str(error) for word in FOREIGN), str(error)
        assert len(str(error)) < 20_000
    assert time.perf_counter() - began < 2.0
