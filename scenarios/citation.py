"""How to cite, from CITATION.cff, as BibTeX."""

from importlib.resources import files
from pathlib import Path
from typing import Any

import yaml


def _text() -> str:
    """CITATION.cff as installed with the package, or at the root of a checkout."""
    installed = files("scenarios") / "CITATION.cff"
    if installed.is_file():
        return installed.read_text(encoding="utf-8")
    return (Path(__file__).parent.parent / "CITATION.cff").read_text(encoding="utf-8")


def _entry(kind: str, key: str, fields: dict[str, str]) -> str:
    body = "".join(f"  {name} = {{{value}}},\n" for name, value in fields.items() if value)
    return f"@{kind}{{{key},\n{body}}}"


def _authors(people: list[dict[str, str]]) -> str:
    return " and ".join(
        p["name"] if "name" in p else f"{p['family-names']}, {p.get('given-names', '')}".rstrip(", ") for p in people
    )


def bibtex() -> str:
    """One entry for the software and one for each paper that it implements."""
    cff: dict[str, Any] = yaml.safe_load(_text())
    entries = [
        _entry(
            "software",
            "active_constraints",
            {
                "title": cff["title"],
                "author": _authors(cff["authors"]),
                "version": str(cff.get("version", "")),
                "year": str(cff.get("date-released", ""))[:4],
                "license": str(cff.get("license", "")),
            },
        )
    ]
    for reference in cff.get("references", []):
        family = reference["authors"][0].get("family-names", "paper").lower()
        kind = "article" if reference["type"] == "article" else "inproceedings"
        place = reference.get("journal") or (reference.get("conference") or {}).get("name", "")
        entries.append(
            _entry(
                kind,
                f"{family}{reference.get('year', '')}",
                {
                    "title": reference["title"],
                    "author": _authors(reference["authors"]),
                    "journal" if kind == "article" else "booktitle": place,
                    "year": str(reference.get("year", "")),
                    "doi": reference.get("doi", ""),
                },
            )
        )
    return "\n\n".join(entries)
