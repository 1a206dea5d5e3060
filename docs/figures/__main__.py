"""Draws every explanatory figure of the documentation anew: ``python -m docs.figures`` in the project's folder."""

from docs.figures import a2_forbidden_region, a3_potential, a5_damping, two_arms, v1_inequality
from docs.figures.drawing import FOLDER, write

FIGURES = (a2_forbidden_region, a3_potential, a5_damping, two_arms, v1_inequality)

if __name__ == "__main__":
    for figure in FIGURES:
        curves, path = figure.curves(), FOLDER / f"{figure.NAME}.svg"
        write(figure.draw(curves), curves, path)
        print(f"{path.relative_to(FOLDER.parent.parent)}: {path.stat().st_size / 1024:.0f} KiB")
