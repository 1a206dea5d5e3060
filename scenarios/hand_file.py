"""Another hand than a scene's, from a file: what the key `hand` of a scene file holds, or a recorded wrench as CSV."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from primitives.errors import FileError, InputError
from primitives.files.document import Problem, refuse
from primitives.files.model import validate
from primitives.files.yaml_file import read
from scenarios.scene import Scene

if TYPE_CHECKING:
    from scenarios.hands_on.pull import Pull
    from scenarios.hands_on.push import Push
    from scenarios.hands_on.scene import HandsOnScene

RECORD = ".csv"
"""How the name of a record ends; every other file is YAML."""
S = TypeVar("S", bound="Scene | HandsOnScene")


def with_hand(scene: S, path: Path) -> S:
    """The scene with the hand of a file, which holds for anatomy from files too.

    Raises
    ------
    InputError : no hand leads the scene.
    FileError : everything that is wrong with the file, with file and line.
    """
    if not isinstance(scene, Scene):
        return scene.with_changes(hand=_at_handle(path, scene), hand_on_files=None)
    if scene.hand is None:
        raise InputError(f'--hand: no hand leads scene "{scene.name}"; take one that a hand leads, see `vfi list`')
    if path.suffix.lower() == RECORD:
        raise FileError(
            str(path),
            f'"{scene.name}" is led along its reference by a spring and a damper, whose keys a YAML file holds '
            "(stiffness, damping, most, ...), not by a recorded wrench",
        )
    from scenarios.by_hand.model import GuideModel

    return scene.with_changes(hand=validate(GuideModel, read(path)).build())


def _at_handle(path: Path, scene: "HandsOnScene") -> "Pull | Push":
    """The hand of a hands-on scene."""
    from admittance.hand_file import load_hand
    from scenarios.hands_on.push import Push
    from scenarios.hands_on.scene_file import HandModel

    if path.suffix.lower() == RECORD:
        load_hand(path)
        return Push(file=str(path.absolute()), interpolate=True)
    document = read(path)
    model = validate(HandModel, document)
    if elsewhere := model.elsewhere(scene.anatomy.parts if scene.anatomy is not None else ()):
        refuse([Problem(document.mark(place), place, text) for place, text in elsewhere])
    hand = model.build()
    if isinstance(hand, Push) and hand.file:
        hand = replace(hand, file=str((path.parent / hand.file).absolute()))
        load_hand(hand.file)
    return hand
