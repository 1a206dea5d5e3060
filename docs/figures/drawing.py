"""What the figures share: colours, and SVG files that hold the numbers they were drawn from.

The numbers are JSON in the file's description, so that a test can tell whether a picture is still what the code says.
"""

import json
from pathlib import Path
from xml.etree import ElementTree

import matplotlib
import numpy as np
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from primitives.checks import Array

Curves = dict[str, Array]
"""Arrays by name, SI units; NaN separates the pieces of a broken line."""

FOLDER = Path(__file__).parent
BOUNDARY, RANGE, FORBIDDEN, GREY = "#D55E00", "#FBE3D3", "#F2A97F", "#777777"
_DIGITS = 6


def _plain(values: Array) -> list[object]:
    """Rounded numbers, None for NaN, which JSON has not."""
    if values.ndim > 1:
        return [_plain(row) for row in values]
    return [None if np.isnan(v) else float(f"{v:.{_DIGITS}g}") for v in values]


def write(figure: Figure, curves: Curves, path: Path) -> None:
    """Write a figure as SVG together with its numbers; the same figure gives the same file to the byte."""
    description = json.dumps({name: _plain(values) for name, values in curves.items()}, separators=(",", ":"))
    FigureCanvasSVG(figure)
    with matplotlib.rc_context({"svg.hashsalt": path.stem}):
        figure.savefig(path, format="svg", metadata={"Date": None, "Description": description})
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join(line.rstrip() for line in lines) + "\n", encoding="utf-8")


def recorded(path: Path) -> Curves:
    """The numbers that a picture was drawn from."""
    found = ElementTree.parse(path).find(".//{http://purl.org/dc/elements/1.1/}description")
    if found is None or not found.text:
        raise ValueError(f"{path}: expected numbers in the description of the picture; draw it with docs.figures")
    return {name: np.array(values, dtype=float) for name, values in json.loads(found.text).items()}
