"""Where in a scene's files stands what a finding is about."""

from pathlib import Path
from typing import Any

from primitives.files.document import Document
from primitives.files.yaml_file import read
from primitives.spec import declared_names
from scenarios.includes import with_sets
from scenarios.scenes import scene_path

_LISTS = (("reference", "waypoints"), ("hand", "waypoints"))
"""Lists whose items findings call waypoint 1, 2, .."""


def places(path_or_name: str, robot: str | None = None) -> dict[str, str]:
    """{constraint, joint or waypoint: file:line} of a scene by name or file; its bases and sets count, nearer first."""
    is_file = path_or_name.endswith((".yaml", ".yml"))
    path: Path | None = Path(path_or_name) if is_file else scene_path(path_or_name, robot)
    out: dict[str, str] = {}
    seen: set[Path] = set()
    while path is not None and path not in seen:
        seen.add(path)
        document = with_sets(read(path), path)
        data = document.data if isinstance(document.data, dict) else {}
        out = _of(document, data) | out
        base = data.get("base")
        path = path.parent / base if isinstance(base, str) else None
    return out


def _of(document: Document, data: dict[str, Any]) -> dict[str, str]:
    """Those of one file."""
    out = {
        name: str(document.mark(("constraints", i)))
        for i, name in enumerate(declared_names(data.get("constraints")))
        if name is not None
    }
    limits = data.get("limits")
    out |= {joint: str(document.mark(("limits", joint))) for joint in (limits if isinstance(limits, dict) else ())}
    for key, below in _LISTS:
        items = data[key].get(below) if isinstance(data.get(key), dict) else None
        for i in range(len(items) if isinstance(items, list) else 0):
            out[f"waypoint {i + 1}"] = str(document.mark((key, below, i)))
    return out
