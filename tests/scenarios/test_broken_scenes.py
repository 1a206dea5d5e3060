"""Broken scene files and what each prints; `python -m tests.scenarios.test_broken_scenes` writes the page of docs/."""

import os
from pathlib import Path

import pytest

from primitives.errors import FileError
from scenarios.scene_file import load_any

FOLDER = Path(__file__).parent / "broken"
PAGE = Path(__file__).parents[2] / "docs" / "broken_scenes.md"
HEAD = """# Broken scenes and what they print

Every file is refused before anything runs, with all of its mistakes at once, each at its line. This page is written by
`python -m tests.scenarios.test_broken_scenes`, and a test compares it with what is printed.
"""
FILES = sorted(FOLDER.glob("*.yaml"))


def printed(file):
    """What loading a file says, without the folder."""
    before = Path.cwd()
    os.chdir(file.parent)
    try:
        load_any(Path(file.name))
    except FileError as error:
        return str(error).replace(str(file.parent.absolute()) + "/", "")
    finally:
        os.chdir(before)
    raise AssertionError(f"{file.name} is not refused")


def page():
    """The page with every file and what it prints."""
    parts = [HEAD]
    for file in FILES:
        text = file.read_text(encoding="utf-8").rstrip("\n")
        shown = "text" if "\t" in text else "yaml"
        parts.append(
            f"## {file.stem.replace('_', ' ')}\n\n````{shown}\n{text}\n````\n\n````text\n{printed(file)}\n````\n"
        )
    return "\n".join(parts)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_each_is_told_with_file_and_line(file):
    lines = printed(file).splitlines()
    named = {line.split(":")[0] for line in lines}
    assert named <= {f.name for f in FILES}, "every line begins with a file"
    assert all(line.split(":")[1].isdecimal() for line in lines), "and the number of a line"
    assert not any(word in line for line in lines for word in ("Traceback", "pydantic", "value_error"))


def test_there_are_twenty_and_the_page_shows_what_is_printed():
    assert len(FILES) >= 20
    assert PAGE.read_text(encoding="utf-8") == page(), "run python -m tests.scenarios.test_broken_scenes"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
