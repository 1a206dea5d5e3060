"""Hostile YAML: what is read, what is refused, and at which line."""

import os
import re
import time

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from primitives.errors import FileError, InputError
from primitives.files import yaml_file
from primitives.files.yaml_data import MAX_DEPTH, MAX_ITEMS, MAX_VALUES
from primitives.files.yaml_file import MAX_BYTES, parse, read, write

PARSERS = sorted({yaml.SafeLoader, getattr(yaml, "CSafeLoader", yaml.SafeLoader)}, key=lambda p: p.__name__)


@pytest.fixture(params=PARSERS, ids=lambda p: p.__name__)
def parser(request, monkeypatch):
    """libyaml, and PyYAML's own parser, which takes its place where libyaml is missing."""
    monkeypatch.setattr(yaml_file, "_PARSER", request.param)


def problems(text):
    """(line, message) of everything that reading finds."""
    try:
        found = [(p.mark.line, p.message) for p in parse(text, "f.yaml").problems]
    except FileError as error:
        assert error.__cause__ is None
        assert error.__suppress_context__ or error.__context__ is None
        found = [
            (int(line), message) for line, message in re.findall(r"^f\.yaml:(\d+): (.*)$", str(error), re.MULTILINE)
        ]
    assert all(
        "yaml.scanner" not in message and "yaml.parser" not in message and "Traceback" not in message
        for _, message in found
    )
    return found


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("5", 5),
        ("-0.5", -0.5),
        ("1e-3", 1e-3),
        ("1E3", 1e3),
        ("+.5", 0.5),
        ("5.", 5.0),
        ("-0.0", -0.0),
        ("010", 10),
        ("123456789012345678901234567890", 123456789012345678901234567890.0),
        ("true", True),
        ("False", False),
        ("null", None),
        ("~", None),
        ("", None),
        ("yes", "yes"),
        ("1:30", "1:30"),
        ("0x10", "0x10"),
        ("1_000", "1_000"),
        ("2026-01-01", "2026-01-01"),
        ("5 mm", "5 mm"),
        ("1e", "1e"),
        ("nan", "nan"),
        ('"5"', "5"),
        ("'true'", "true"),
        ("<<", "<<"),
    ],
)
def test_scalars(parser, text, value):
    got = parse(f"a: {text}\n", "f.yaml").data["a"]
    assert repr(got) == repr(value)


def test_every_value_has_the_line_of_its_key_or_item(parser):
    document = parse("# c\na:\n  b: 1\n\n  c:\n    - x\n    - {d:\n        2}\ne: [1,\n 2]\n", "f.yaml")
    assert document.data == {"a": {"b": 1, "c": ["x", {"d": 2}]}, "e": [1, 2]}
    lines = {path: mark.line for path, mark in document.marks.items()}
    assert lines == {
        (): 1,
        ("a",): 2,
        ("a", "b"): 3,
        ("a", "c"): 5,
        ("a", "c", 0): 6,
        ("a", "c", 1): 7,
        ("a", "c", 1, "d"): 7,
        ("e",): 9,
        ("e", 0): 9,
        ("e", 1): 10,
    }
    assert document.mark(("a", "c", 9, "z")).line == 5
    assert str(document.mark(("nowhere",))) == "f.yaml:1"


BROKEN = {
    "duplicate key": ("a: 1\nb: 2\na: 3\n", [(3, "line 1 already")]),
    "duplicate key below": ("a:\n  - {x: 1,\n     x: 2}\n", [(3, "a[0].x: this key stands in line 2")]),
    "alias": ("a: 1\nb: *a\n", [(2, "alias *a is not allowed")]),
    "anchor": ("a: &k [1]\n", [(1, "anchor &k is not allowed")]),
    "anchored key": ("&k a: 1\n", [(1, "a: anchors and tags are not allowed")]),
    "tag": ("a: 1\nb: !!python/object:os.system x\n", [(2, "is not allowed")]),
    "tag of a key": ("!!str a: 5\n", [(1, "a: anchors and tags are not allowed")]),
    "tag of a float": ("a: !!float 5\n", [(1, "is not allowed")]),
    "NaN": ("a:\n  b: [1, .nan]\n", [(2, "a.b[1]: expected a finite number, got .nan")]),
    "infinity": ("a: -.Inf\n", [(1, "finite")]),
    "too large a number": ("a: 1e999\n", [(1, "finite")]),
    "digits without end": (f"a: {'9' * 5000}\n", [(1, "finite")]),
    "list as key": ("a: 1\n? [1, 2]\n: 3\n", [(2, "expected a text as key")]),
    "empty key": ("a: 1\n?\n: 3\n", [(2, "expected a text as key")]),
    "all at once": ("a: .inf\na: 1\nb: *x\n", [(1, "finite"), (2, "line 1 already"), (3, "alias")]),
    "problem, then syntax": ("a: .inf\nb: [1\n", [(1, "finite"), (2, "has no end")]),
    "tab": ("a:\n\tb: 1\n", [(2, "a tab indents")]),
    "tab after spaces": ("a:\n  b: 1\n \tc: 1\n", [(3, "a tab indents")]),
    "open bracket": ("a: 1\nb: [1, 2\n", [(2, "has no end; check quotes and brackets")]),
    "open bracket, then a key": ("a: [1, 2\nb: 3\n", [(2, "begins in line 1")]),
    "open quote": ("a: 1\nb: 'x\nc: 3\n", [(2, "has no end")]),
    "colon in text": ("a: 1\nb: x: y\n", [(2, 'text that holds ": " in quotes')]),
    "indentation": ("a: 1\n b: 2\n", [(2, "check the indentation")]),
    "list among keys": ("a: 1\n- b\n", [(2, "not YAML")]),
    "reserved character": ("a: 1\nb: @x\n", [(2, "cannot start any token")]),
    "unknown escape": ('a: "\\q"\n', [(1, "unknown escape character")]),
    "control character": ("a: 1\nb: x\x07\n", [(2, "character U+0007 is not allowed")]),
    "line separator": ("a: 1\r\nb: x\u2028\n", [(2, "character U+2028 is not allowed")]),
    "lone surrogate": ("a: \ud800\n", [(1, "character U+D800 is not allowed")]),
    "second document": ("a: 1\n---\nb: 1\n", [(2, "a second document begins here")]),
    "too deep": ("a: " + "[" * (MAX_DEPTH + 1), [(1, "nested more than 32 deep")]),
    "deep keys": ("? " * (MAX_DEPTH + 2), [(1, "expected a text as key")]),
    "too many items": ("a:\n" + "  - 1\n" * (MAX_ITEMS + 1), [(MAX_ITEMS + 2, "a: more than 1000 items")]),
    "too many keys": ("".join(f"k{i}: 1\n" for i in range(MAX_ITEMS + 1)), [(MAX_ITEMS + 1, "more than 1000")]),
    "too many values": ("- [" + "1," * 999 + "]\n" + ("- [" + "1," * 999 + "]\n") * 60, [(50, str(MAX_VALUES))]),
    "empty": ("", [(1, "is empty; expected keys and values")]),
    "only a comment": ("# nothing\n", [(1, "is empty")]),
    "null": ("~\n", [(1, "is empty")]),
    "YAML 2": ("%YAML 2.0\n---\na: 1\n", [(1, "incompatible")]),
}


def messages_fit(found, expected):
    lines = [(line, words, [m for at, m in found if at == line]) for line, words in expected]
    return len(found) == len(expected) and all(any(words in m for m in got) for _, words, got in lines)


@pytest.mark.parametrize("case", BROKEN)
def test_broken_files_say_where_and_what(case):
    text, expected = BROKEN[case]
    found = problems(text)
    assert messages_fit(found, expected), found


@pytest.mark.parametrize("case", BROKEN)
def test_without_libyaml_the_lines_are_the_same(case, monkeypatch):
    monkeypatch.setattr(yaml_file, "_PARSER", yaml.SafeLoader)
    text, expected = BROKEN[case]
    assert [line for line, _ in problems(text)] == [line for line, _ in expected]


def test_an_escape_that_is_no_character_is_refused_without_libyaml_too(parser):
    with pytest.raises(FileError, match=r"^f\.yaml(:1)?: .*not YAML"):
        parse('a: "\\UFFFFFFFF"\n', "f.yaml")


def test_problems_are_counted_not_listed_without_end():
    found = problems("".join(f"a{i}: *x\n" for i in range(900)))
    assert len(found) == 20


def refused(path):
    with pytest.raises(FileError) as caught:
        read(path)
    assert str(path) in str(caught.value)
    return str(caught.value)


def test_files_that_cannot_be_read(tmp_path):
    assert "no such file; check the path" in refused(tmp_path / "missing.yaml")
    assert "is a folder; name a YAML file" in refused(tmp_path)
    assert "cannot be read" in refused(tmp_path / ("x" * 300 + ".yaml"))
    with pytest.raises(FileError, match="cannot be read"):
        read("a\0b.yaml")
    os.mkfifo(tmp_path / "pipe.yaml")
    assert "is no ordinary file" in refused(tmp_path / "pipe.yaml")
    assert "is no ordinary file" in refused("/dev/zero")
    big = tmp_path / "big.yaml"
    big.write_bytes(b"#" * (MAX_BYTES + 1))
    assert "is larger than 1000 kB" in refused(big)


@pytest.mark.parametrize(
    ("raw", "line"),
    [(b"a: 1\nb: \xff\n", 2), (b"a: caf\xe9\n", 1), ("a: 1\n".encode("utf-16"), 1), (b"\n\n\xc3", 3)],
)
def test_not_utf_8(tmp_path, raw, line):
    file = tmp_path / "f.yaml"
    file.write_bytes(raw)
    assert f"f.yaml:{line}: byte" in refused(file)
    assert "save the file as UTF-8" in refused(file)


def test_a_byte_order_mark_and_windows_line_ends_are_taken(tmp_path):
    file = tmp_path / "f.yaml"
    file.write_bytes("\ufeffa: 1\r\nb: ü\r\n".encode())
    document = read(file)
    assert document.data == {"a": 1, "b": "ü"}
    assert document.mark(("b",)).line == 2


def test_what_would_steer_a_terminal_is_escaped(tmp_path):
    file = tmp_path / "\x1b[31m.yaml"
    file.write_text('"\\e[2J\\u202e": 1\n"\\e[2J\\u202e": 2\n')
    document = read(file)
    text = str(document.problems[0].mark)
    with pytest.raises(FileError) as caught:
        yaml_file.refuse(document.problems)
    assert (text + str(caught.value)).isprintable()


@pytest.mark.parametrize(
    "text",
    [
        "[" * 999_999,
        "{a: " * 240_000,
        "- " * 499_000,
        "? " * 499_000,
        "#" * 999_999,
        '"' + "\\n" * 499_000 + '"',
        "a: |\n" + " x\n" * 330_000,
        "[" + "1," * 499_000 + "]",
        "".join(f"k{i}: 1\n" for i in range(80_000)),
        "a: 1\n" * 190_000,
        "a: &a [x]\nb: &b [*a,*a]\nc: &c [*b,*b]\n",
        '"' + "k" * 990_000 + '": 1\n',
        "? " + "k" * 990_000 + "\n: .nan\n",
    ],
    ids=range(13),
)
def test_a_megabyte_is_read_or_refused_within_two_seconds(text):
    began = time.perf_counter()
    found = problems(text)
    assert time.perf_counter() - began < 2.0
    assert all(len(str(message)) < 1_000_100 for _, message in found)
    if found:
        with pytest.raises(FileError) as caught:
            yaml_file.refuse(parse(text, "f.yaml").problems)
        assert len(str(caught.value)) < 20_000


NAMES = st.text(st.characters(exclude_categories=("Cs",)), max_size=30).filter(
    lambda t: not yaml_file._UNPRINTABLE.search(t)
)
NUMBERS = st.floats(allow_nan=False, allow_infinity=False) | st.integers(-(10**15) + 1, 10**15 - 1)
PLAIN = st.recursive(
    st.none() | st.booleans() | NUMBERS | NAMES,
    lambda below: st.lists(below, max_size=4) | st.dictionaries(NAMES, below, max_size=4),
    max_leaves=12,
)
TRICKY = [
    "yes",
    "1e-3",
    "-5",
    ".5",
    "null",
    "~",
    "",
    " x",
    "x ",
    "#",
    "a: b",
    "- a",
    "&a",
    "*a",
    "!t",
    "%",
    "@",
    "x\ny",
]


@given(PLAIN.filter(lambda data: data is not None))
def test_what_is_written_is_read_back_to_the_bit(data):
    assert repr(parse(write(data), "f.yaml").data) == repr(data)


@pytest.mark.parametrize("text", TRICKY)
def test_text_that_looks_like_something_else_stays_text(text):
    assert parse(write({text: [text, {"k": text}]}), "f.yaml").data == {text: [text, {"k": text}]}


def test_a_list_that_stands_twice_needs_no_alias():
    item = [1.0, 2.0]
    assert parse(write({"a": item, "b": item}), "f.yaml").data == {"a": item, "b": item}


@pytest.mark.parametrize(
    "data", [{"a": float("nan")}, {"a": float("inf")}, {"a": object()}, {"a": (1, 2)}, {"a": list(range(1001))}]
)
def test_what_cannot_be_written_is_refused(data):
    with pytest.raises(InputError):
        write(data)
