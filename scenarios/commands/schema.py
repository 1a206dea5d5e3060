"""`vfi schema`: what editors need to complete and check scene files."""

import json
from enum import StrEnum
from typing import Annotated

import typer

from scenarios.commands.errors import one_clear_line


class FileKind(StrEnum):
    """The kinds of files there is a schema of."""

    scene = "scene"
    constraints = "constraints"


def schema(
    kind: Annotated[FileKind, typer.Argument(help="Of which files: scenes, or constraints alone.")] = FileKind.scene,
) -> None:
    """Print the JSON Schema of scene files, with which editors complete and check them."""
    with one_clear_line():
        from scenarios.schema import constraints_schema, scene_schema

        found = scene_schema() if kind is FileKind.scene else constraints_schema()
    print(json.dumps(found, indent=2))
