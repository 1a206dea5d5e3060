"""YAML files, which may be hostile, to plain data and the line where each value stands; and plain data to YAML.

Refused, each with its line: a key given twice, anchors, aliases and tags, numbers that are not finite, control
characters, a second document, and what is too large or too deep to have been written by hand.
"""

import re
import stat
from pathlib import Path
from typing import Any

import yaml

from primitives.errors import FileError
from primitives.files.document import Document, Mark, Problem, printable, refuse
from primitives.files.yaml_data import Builder, UnreadableError
from primitives.files.yaml_scalars import to_yaml

MAX_BYTES = 1_000_000

_PARSER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
# U+0085, U+2028 and U+2029 end a line for YAML but not for the editor by whose line numbers people go.
_UNPRINTABLE = re.compile("[^\t\n\r -~\xa0-\u2027\u202a-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_LINE_END = re.compile("\r\n|\r|\n")


def read(path: str | Path) -> Document:
    """The document of a file.

    Raises
    ------
    FileError : missing, no ordinary file, larger than `MAX_BYTES`, not UTF-8, or not YAML. What is wrong with single
        values is left to the document's problems, so that it can be told together with what else is wrong.
    """
    file = printable(str(path))
    try:
        mode = Path(path).stat().st_mode
        if not stat.S_ISREG(mode):
            raise FileError(file, f"is {'a folder' if stat.S_ISDIR(mode) else 'no ordinary file'}; name a YAML file")
        with Path(path).open("rb") as stream:
            raw = stream.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise FileError(file, "there is no such file; check the path") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise FileError(file, f"cannot be read ({reason}); check the path and its permissions") from None
    if len(raw) > MAX_BYTES:
        raise FileError(file, f"is larger than {MAX_BYTES // 1000} kB, the most that is read; is it the right file?")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise FileError(
            f"{file}:{line}", f"byte 0x{raw[error.start]:02x} is not UTF-8; save the file as UTF-8"
        ) from None
    return parse(text, file)


def parse(text: str, file: str) -> Document:
    """The document in a text; `file` is what errors call it. Raises FileError where it is not YAML."""
    builder = Builder(iter(yaml.parse(text, Loader=_PARSER)), file)
    if odd := _UNPRINTABLE.search(text):
        mark = Mark(file, len(_LINE_END.findall(text, 0, odd.start())) + 1)
        refuse([Problem(mark, (), f"character U+{ord(odd[0]):04X} is not allowed here; delete it")])
    try:
        data = builder.document()
    except UnreadableError:
        refuse(builder.problems)
    except yaml.MarkedYAMLError as error:
        builder.problems.append(_syntax(error, text, file))
        refuse(builder.problems)
    except (yaml.YAMLError, ValueError, OverflowError) as error:
        refuse([*builder.problems, Problem(Mark(file, 0), (), f"is not YAML ({error})")])
    return Document(data, builder.marks, tuple(builder.problems))


def write(data: Any) -> str:
    """Plain data as the text of a file that `read` takes.

    Raises
    ------
    InputError : what `read` would refuse, e.g. a number that is not finite or more than `MAX_ITEMS` items.
    """
    text = to_yaml(data)
    document = parse(text, "text to write")
    if document.problems or document.data != data:
        refuse(document.problems or [Problem(document.mark(()), (), "cannot be written to YAML without loss")])
    return text


def _syntax(error: yaml.MarkedYAMLError, text: str, file: str) -> Problem:
    at, begun = error.problem_mark, error.context_mark
    since, hint = "", "check this line and the one above"
    if begun is not None and (at is None or not text[at.index :].strip()):
        at, hint = begun, "what begins here has no end; check quotes and brackets"
    elif begun is not None:
        since = f", {error.context} that begins in line {begun.line + 1}"
    if "mapping values" in str(error.problem):
        hint = 'check the indentation, and put text that holds ": " in quotes'
    line = at.line if at is not None else 0
    lines = _LINE_END.split(text)
    content = lines[min(line, len(lines) - 1)]
    mark = Mark(file, line + 1)
    if "\t" in content[: len(content) - len(content.lstrip())]:
        return Problem(mark, (), "a tab indents this line; YAML is indented with spaces")
    return Problem(mark, (), f"not YAML: {error.problem}{since}; {hint}")
