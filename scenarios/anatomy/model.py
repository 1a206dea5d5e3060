"""What a scene file may hold of its anatomy: the key `anatomy`."""

from dataclasses import asdict
from typing import Annotated, Any, Self, get_args

from pydantic import Field, model_validator

from primitives.files.fields import one_of
from primitives.files.model import FileModel
from primitives.files.quantities import Angle, Position, PositiveAngle, PositiveLength
from primitives.point_cloud import Gaps
from primitives.units import METRES
from scenarios.anatomy.parts import KINDS, AnatomySource


class AnatomyModel(FileModel):
    """The key `anatomy` of a scene; see `AnatomySource`."""

    declares = AnatomySource
    kind: Annotated[str, one_of("kind of anatomy", lambda: KINDS)]
    cover: dict[str, PositiveLength]
    at: Position = Field(default=[0.0, 0.0, 0.0])
    turn: Angle = AnatomySource.turn
    radius: PositiveLength = AnatomySource.radius
    opening: PositiveAngle = AnatomySource.opening
    organ: str = AnatomySource.organ
    vessels: str = AnatomySource.vessels
    unit: Annotated[str, one_of("unit of length", lambda: METRES)] = AnatomySource.unit
    depth: PositiveLength = AnatomySource.depth
    gaps: Annotated[Gaps, one_of("way to treat gaps", lambda: get_args(Gaps))] = AnatomySource.gaps

    @model_validator(mode="after")
    def _fits(self) -> Self:
        self.build()
        return self

    def build(self) -> AnatomySource:
        """The anatomy that the file declares."""
        x, y, z = self.at
        return AnatomySource(**(self.model_dump() | {"at": (x, y, z)}))


def anatomy_data(source: AnatomySource | None) -> dict[str, Any]:
    """The key as plain data, from which the model builds an equal one; nothing where there is no anatomy."""
    if source is None:
        return {}
    return {"anatomy": {**asdict(source), "at": list(source.at), "cover": dict(source.cover)}}
