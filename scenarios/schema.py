"""JSON Schemas (2020-12) of the files that are loaded, made from the models that load them, for editors.

A schema knows what a file may hold, not what its names refer to: frames, joints and files beside it are not looked up.
It takes whatever is loaded, and refuses what is wrong in a file's form.
"""

from typing import Annotated, Any

from pydantic import Field, GetJsonSchemaHandler
from pydantic.json_schema import GenerateJsonSchema, models_json_schema
from pydantic_core import CoreSchema

from primitives.files.fields import items
from primitives.files.model import FileModel
from primitives.spec import ConstraintsModel, DeclaredField
from scenarios.hands_on.scene_file import HandsOnModel
from scenarios.includes import KEYS, MAX_FILES
from scenarios.scene_file import HANDS_ON_KEYS
from scenarios.scene_model import SceneModel


class _WithOthers(FileModel):
    """What a scene file may hold beside its own keys."""

    base: Annotated[str, Field(description="file of the same folder; its keys stand where this file does not.")] = ""
    include: Annotated[
        list[str], items(0, MAX_FILES), Field(description="files of the same folder, whose sets may be used.")
    ] = []
    sets: Annotated[dict[str, DeclaredField], Field(description="lists of constraints by name.")] = {}
    use: Annotated[list[str], Field(description="sets that are joined behind the constraints.")] = []

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler, /) -> dict[str, Any]:
        schema = super().__get_pydantic_json_schema__(core, handler)
        found = handler.resolve_ref_schema(schema)
        needed = [key for key in found.pop("required") if key != "constraints"]
        found["allOf"] = [
            {"if": _any_of(["base"]), "else": {"required": needed}},
            {"if": _any_of(["base", *KEYS]), "else": {"required": ["constraints"]}},
        ]
        return schema


class _SceneFile(SceneModel, _WithOthers):
    """A scene: a robot whose tool follows a trajectory, by itself or led by a hand."""


class _HandsOnFile(HandsOnModel, _WithOthers):
    """A hands-on scene: a hand leads a tool through a port."""


def _any_of(keys: Any) -> dict[str, Any]:
    return {"anyOf": [{"required": [key]} for key in sorted(keys)]}


def scene_schema() -> dict[str, Any]:
    """JSON Schema of scene files; which kind a file is, is decided as `scenarios.scene_file.load_any` does.

    What only the base of a file can tell leaves both.
    """
    models = [(_SceneFile, "validation"), (_HandsOnFile, "validation")]
    refs, definitions = models_json_schema(models, ref_template="#/$defs/{model}")
    scene, hands_on = (refs[model] for model in models)
    without_base = {"if": _any_of(HANDS_ON_KEYS), "then": hands_on, "else": scene}
    without_reference = {"if": _any_of(["base"]), "then": {"anyOf": [scene, hands_on]}, "else": without_base}
    return {
        "$schema": GenerateJsonSchema.schema_dialect,
        "title": "Scene of active-constraints",
        "type": "object",
        "if": _any_of(["reference"]),
        "then": scene,
        "else": without_reference,
        **definitions,
    }


def constraints_schema() -> dict[str, Any]:
    """JSON Schema of files with constraints alone, as `primitives.spec.load_constraints` takes them."""
    schema = ConstraintsModel.model_json_schema()
    return {"$schema": GenerateJsonSchema.schema_dialect, "title": "Constraints of active-constraints", **schema}
