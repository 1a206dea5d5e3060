"""What there is to name on the command line: scenes, robots, solvers, primitives."""

from primitives.registry import pairs
from scenarios.robots import robots
from scenarios.scene_file import load_any
from scenarios.scenes import scene_names
from vfi.backends import solvers


def _first_line(text: str | None) -> str:
    """The first sentence of a docstring, as far as it stands on the first line."""
    return text.splitlines()[0].split(". ")[0].strip() if text else ""


def catalogue() -> dict[str, dict[str, str]]:
    """{kind: {name: one line}}."""
    return {
        "scenes": {name: load_any(name).summary for name in scene_names()},
        "robots": {name: robots[name].summary for name in robots.names()},
        "solvers": {name: solvers[name].summary for name in solvers.names()},
        "primitives": {name: _first_line(pairs[name].kernel.__doc__) for name in pairs.names()},
    }
