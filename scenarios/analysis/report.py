"""The report of a comparison: one HTML file that needs no network, and its figures as PNG and SVG."""

import json
from collections.abc import Callable, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from primitives.errors import FileError, InputError
from scenarios.analysis import draw_matplotlib, draw_plotly, report_table
from scenarios.analysis.cells import GUARDED, Cell
from scenarios.analysis.comparison_folder import FIGURES, REPORT, Comparison
from scenarios.analysis.figures import save
from scenarios.analysis.followed_charts import followed_pictures
from scenarios.analysis.followed_view import followed_view
from scenarios.analysis.hands_on_charts import pictures
from scenarios.analysis.hands_on_view import view
from scenarios.analysis.kept import to_keep
from scenarios.analysis.kinds import BY_HAND, HANDS_ON, TRAJECTORY
from scenarios.analysis.look import looks
from scenarios.analysis.picture import Picture
from scenarios.analysis.spread_chart import spread
from scenarios.analysis.statistics import FEWEST, LEVEL, RESAMPLES
from scenarios.anatomy.parts import build_parts
from scenarios.hands_on.scene import HandsOnScene
from scenarios.resolved import resolved_scene

TEMPLATE = "report.html.j2"
SAME = {
    HANDS_ON: "The same hand, anatomy and seeds",
    BY_HAND: "The same hand, constraints and seeds",
    TRAJECTORY: "The same reference and constraints",
}
"""What all cells of an arm have in common."""
FACTS = {"plant": "plant", "integrator": "integrator", "solver": "solver", "coordination": "coordination"}
"""What is said of how the runs were made, and the key of a result that says it."""


def write_report(comparison: Comparison, progress: Callable[[float], None] | None = None) -> list[Path]:
    """Write the report and the figures into the folder of a comparison; the files written.

    Raises
    ------
    InputError : the extra "report" is not installed. FileError : a trace cannot be read, or a file not be written.
    """
    try:
        from jinja2 import Environment
        from plotly.offline import get_plotlyjs
    except ImportError as error:
        what = 'a report takes the extra "report": pip install "active-constraints[report]"'
        raise InputError(f"{what} ({error})") from None
    sections, written = [], []
    cells = comparison.cells
    arms = list(dict.fromkeys(cell.robot for cell in cells))
    for i, robot in enumerate(arms):
        mine = [cell for cell in cells if cell.robot == robot]
        drawn, scene_text = _pictures(comparison, mine)
        sections.append(_section(robot, mine, drawn, scene_text))
        for picture in drawn:
            written += save(draw_matplotlib.figure(picture), comparison.folder / FIGURES, f"{robot}-{picture.name}")
        if progress is not None:
            progress((i + 1) / len(arms))
    environment = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    template = environment.from_string((files("scenarios.analysis") / TEMPLATE).read_text(encoding="utf-8"))
    page = template.render(**_facts(comparison, cells, arms), sections=sections, plotly=get_plotlyjs())
    report = comparison.folder / REPORT
    try:
        report.write_text(page, encoding="utf-8")
    except OSError as error:
        raise FileError(str(report), f"cannot be written ({error})") from None
    return [report, *written]


def _pictures(comparison: Comparison, cells: Sequence[Cell]) -> tuple[list[Picture], str]:
    """What is drawn of one arm, from the first seed of each of its cells, and its scene as YAML."""
    traces = [comparison.trace(cell.runs[0]) for cell in cells]
    scene = resolved_scene(traces[0])
    runs = list(zip(cells, looks(cells), traces, strict=True))
    if isinstance(scene, HandsOnScene):
        parts = build_parts(scene.anatomy, scene.port)
        drawn = pictures([view(cell, look, trace, scene, parts) for cell, look, trace in runs], scene, parts)
    else:
        drawn = followed_pictures([followed_view(*run) for run in runs], to_keep(scene))
    if len(cells[0].runs) > 1:
        drawn.insert(0, spread(cells))
    return drawn, str(traces[0].header["resolved_scene"])


def _section(robot: str, cells: Sequence[Cell], drawn: Sequence[Picture], scene_text: str) -> dict[str, Any]:
    pairs, differences = report_table.differences(cells)
    return {
        "robot": robot,
        "names": [cell.name for cell in cells],
        "rows": report_table.rows(cells),
        "merits": report_table.merits(cells),
        "notes": report_table.notes(cells),
        "pairs": pairs,
        "differences": differences,
        "scene": scene_text,
        "seed": cells[0].runs[0]["seed"],
        "pictures": [
            {"id": f"{robot}-{p.name}", "title": p.title, "caption": p.caption, "figure": _embedded(p)} for p in drawn
        ],
    }


def _embedded(picture: Picture) -> str:
    """A figure as JSON that can stand within a script element."""
    text = json.dumps(draw_plotly.figure(picture), separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c")


def _facts(comparison: Comparison, cells: Sequence[Cell], arms: Sequence[str]) -> dict[str, Any]:
    first = comparison.results[0]
    seeds = [r["seed"] for r in cells[0].runs]
    return {
        "scene": first["scene"],
        "arms": arms,
        "methods": (", " if all("," not in cell.name for cell in cells) else "; ").join(
            dict.fromkeys(cell.name for cell in cells)
        ),
        "runs": len(comparison.results),
        "seeds": f"{seeds[0]} to {seeds[-1]}" if len(seeds) > 1 else str(seeds[0]),
        "per_cell": len(seeds),
        "same": SAME[first["kind"]],
        "random": first["kind"] != TRAJECTORY,
        "kind": first["kind"],
        "made": {
            label: ", ".join(dict.fromkeys(str(r[key]) for r in comparison.results))
            for label, key in FACTS.items()
            if first.get(key)
        },
        "period_ms": f"{1e3 * float(first['period_s']):g}",
        "guards": ", ".join(dict.fromkeys(GUARDED[cell.guard] for cell in cells)),
        "versions": first["versions"],
        "command": comparison.command,
        "level": f"{LEVEL:.0%}",
        "fewest": FEWEST,
        "resamples": RESAMPLES,
    }
