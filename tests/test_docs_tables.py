"""The measured tables of the documentation are what `docs.tables` measures today."""

import re
from pathlib import Path

import pytest

from docs.tables.__main__ import TABLES, markdown
from tests.docs_page import agree

PAGES = sorted((Path(__file__).parent.parent / "docs").glob("*.md"))
SHOWN = re.compile(r"<!-- python -m docs\.tables (?P<name>[\w-]+) -->\n\n(?P<table>(?:\|.*\n)+)")
SLOW = ("period", "potential", "push", "metric", "hand-matrix", "hand-push")


def shown() -> dict[str, str]:
    """Each table of the pages, by its name."""
    found = [(m["name"], m["table"]) for page in PAGES for m in SHOWN.finditer(page.read_text(encoding="utf-8"))]
    assert len(dict(found)) == len(found), "a table stands in two places"
    return dict(found)


def test_every_table_stands_in_a_page():
    assert shown().keys() == TABLES.keys()


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.slow if n in SLOW else ()) for n in TABLES])
def test_table_is_what_is_measured(name):
    measured = markdown(name)
    assert agree(measured, shown()[name]), f"python -m docs.tables {name}\n{measured}"
