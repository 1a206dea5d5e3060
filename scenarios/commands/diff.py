"""`vfi diff`: what tells two runs apart."""

import json
from pathlib import Path
from typing import Annotated

import typer

from scenarios.commands.errors import one_clear_line

DIFFERENT = 1
"""Exit code for runs that differ; 0 where they are equal to the bit."""


def diff(
    run_a: Annotated[Path, typer.Argument(metavar="RUN_A.mcap", help="Trace of a run.")],
    run_b: Annotated[Path, typer.Argument(metavar="RUN_B.mcap", help="Trace of another.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of text.")] = False,
) -> None:
    """Say where two runs differ. Exits with 0 when they are equal to the bit, times aside, and 1 when they differ."""
    with one_clear_line():
        from scenarios.analysis.difference import compare_traces
        from scenarios.analysis.trace import Trace

        found = compare_traces(Trace.load(run_a), Trace.load(run_b))
    if as_json:
        print(json.dumps(found.data(), indent=2))
    else:
        from scenarios.difference_text import print_difference
        from scenarios.table import console_for_tables

        print_difference(found, str(run_a), str(run_b), console_for_tables())
    if not found.equal:
        raise typer.Exit(DIFFERENT)
