"""JSON Schemas (2020-12) of the files that are loaded, made from the models that load them, for editors.

A schema knows what a file may hold, not what its names refer to: frames, joints and files beside it are not looked up.
It takes whatever is loaded, and refuses what is wrong in a file's form.
"""

from collections.abc import Iterable
from typing import Annotated, Any

from pydantic import Field, GetJsonSchemaHandler, TypeAdapter
from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import CoreSchema

from primitives.files.fields import items
from primitives.files.model import FileModel
from primitives.spec import ConstraintsModel, DeclaredField
from scenarios.hands_on.scene_file import HandsOnModel
from scenarios.includes import KEYS, MAX_FILES
from scenarios.scene_file import HANDS_ON_KEYS
from scenarios.scene_model import SceneModel

DIALECT = GenerateJsonSchema.schema_dialect


class _WithOthers(FileModel):
    """What a scene file may hold beside its own keys; see `scenarios.includes`."""

    base: str = Field(default="", description="A file of the same folder; its keys hold where this file has none.")
    include: Annotated[list[str], items(0, MAX_FILES)] = Field(
        default_factory=list, description="Files of the same folder whose sets may be used."
    )
    sets: dict[str, DeclaredField] = Field(default_factory=dict, description="Lists of constraints by name.")
    use: list[str] = Field(default_factory=list, description="Sets that are joined behind the constraints.")

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


def _any_of(keys: Iterable[str]) -> dict[str, Any]:
    return {"anyOf": [{"required": [key]} for key in sorted(keys)]}


def _switch(*cases: tuple[Iterable[str], Any], otherwise: Any) -> Any:
    """The schema of the first case of which a file has a key."""
    for keys, found in reversed(cases):
        otherwise = {"if": _any_of(keys), "then": found, "else": otherwise}
    return otherwise


def scene_schema() -> dict[str, Any]:
    """JSON Schema of scene files; which kind a file is of is decided as `scenarios.scene_file.load_any` does.

    Where only the base of a file can tell, and no key that one of the kinds alone has, it may be of either.
    """
    either: TypeAdapter[Any] = TypeAdapter(_SceneFile | _HandsOnFile)
    definitions = either.json_schema()
    scene, hands_on = definitions.pop("anyOf")
    own, other = _SceneFile.model_fields.keys(), _HandsOnFile.model_fields.keys()
    on_base = _switch((other - own, hands_on), (own - other, scene), otherwise={"anyOf": [scene, hands_on]})
    found = _switch((["reference"], scene), (["base"], on_base), (HANDS_ON_KEYS, hands_on), otherwise=scene)
    return {"$schema": DIALECT, "title": "Scene of active-constraints", "type": "object", **found, **definitions}


def constraints_schema() -> dict[str, Any]:
    """JSON Schema of files with constraints alone, as `primitives.spec.load_constraints` takes them."""
    schema = ConstraintsModel.model_json_schema()
    return {"$schema": DIALECT, "title": "Constraints of active-constraints", **schema}
