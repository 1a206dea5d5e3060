"""What editors are told of values that may be of several sorts: only the one that is meant is checked.

So a mistake is shown at its own place, and not as "none of these" at the whole value.
"""

from dataclasses import dataclass
from typing import Any

from pydantic import GetJsonSchemaHandler
from pydantic_core import CoreSchema


@dataclass(frozen=True, eq=False)
class ByKind:
    """JSON Schema of a union of mappings, each of a kind of its own but the last, the plain form.

    Attributes
    ----------
    kinds : what `kind` says of each but the last, in their order.
    plain : a schema of the mappings that are in the plain form.
    """

    kinds: tuple[str, ...]
    plain: Any

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        *models, plain = handler(core)["anyOf"]
        each = [
            {"if": {"properties": {"kind": {"const": kind}}}, "then": model}
            for kind, model in zip(self.kinds, models, strict=True)
        ]
        by_kind = {"required": ["kind"], "properties": {"kind": {"enum": list(self.kinds)}}, "allOf": each}
        return {"type": "object", "if": self.plain, "then": plain, "else": by_kind}


@dataclass(frozen=True, eq=False)
class IfType:
    """JSON Schema of a union of two: a value of a type of JSON, "object" or "array", can only be the first."""

    type: str

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        first, second = handler(core)["anyOf"]
        of_first = {"type": self.type}
        # Editors offer the names of an `anyOf` where there is no value yet, but not those of an `else`.
        rest = {"anyOf": [second, of_first]} if "enum" in second else {"else": second}
        return {"if": of_first, "then": first, **rest}
