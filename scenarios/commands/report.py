"""`vfi report`: the report of a comparison, made again."""

from pathlib import Path
from typing import Annotated

import typer

from scenarios.commands.errors import one_clear_line


def report(
    folder: Annotated[Path, typer.Argument(help="What `vfi compare --out` wrote.")],
) -> None:
    """Make report.html and the figures of a comparison again, from its results and traces."""
    with one_clear_line():
        from scenarios.analysis.comparison_folder import load_comparison, make_folder
        from scenarios.analysis.report import write_report

        comparison = load_comparison(folder)
        make_folder(folder)
        for file in write_report(comparison):
            print(file)
