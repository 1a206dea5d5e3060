"""YAML <-> `Scene` and `HandsOnScene`, without loss.

A file may build on another of its folder: ``base: neurosurgery.yaml`` takes every key from there that the file does
not give itself. ``enforce: [C1, C2]`` chooses which constraints are enforced; the others are watched.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from primitives.errors import InputError
from primitives.files.document import Document, Problem, refuse
from primitives.files.model import Names, show, validate
from primitives.files.yaml_file import read, write
from primitives.flatten import motion_axis
from primitives.spec import declared_names
from scenarios.anatomy.parts import KINDS, part_names
from scenarios.includes import beside, with_sets
from scenarios.own_robot import OwnRobot, entry_of
from scenarios.own_robot_file import robot_of
from scenarios.scene import Scene
from scenarios.scene_model import SceneModel, scene_data
from scenarios.scenes import scene_path

if TYPE_CHECKING:
    from scenarios.hands_on.scene import HandsOnScene

HANDS_ON_KEYS = frozenset({"port", "hand"})
"""A file with any of these is a hands-on scene, unless it has a trajectory as its reference."""


def load_scene(path_or_name: str | Path) -> Scene:
    """A scene whose reference is a trajectory, by its name or from a file; see `load_any`.

    Raises
    ------
    InputError : it is a hands-on scene. Others as `load_any`.
    """
    scene = load_any(path_or_name)
    if not isinstance(scene, Scene):
        raise InputError(f'scene "{scene.name}" is led by a hand, expected one that follows a trajectory')
    return scene


def load_any(path_or_name: str | Path, robot: str | None = None) -> "Scene | HandsOnScene":
    """A scene by its name, or from a file: whatever is a Path or ends in ".yaml" or ".yml".

    A file that has a port or a hand, but no reference, is a hands-on scene; files that it names are looked for from
    its own folder. robot chooses a named scene's variant for that robot, if it has one.

    Raises
    ------
    FileError : everything that is wrong with the file and its bases, a line each, with file and line.
    UnknownNameError : no such scene.
    """
    is_file = isinstance(path_or_name, Path) or path_or_name.endswith((".yaml", ".yml"))
    path = Path(path_or_name) if is_file else scene_path(str(path_or_name), robot)
    document = with_sets(_with_bases(path, ()), path)
    try:
        names = _names(document.data, path.parent)
    except InputError as error:
        mark = document.mark(("robot",))
        refuse([*document.problems, Problem(mark, ("robot",), f"robot: {error}")])
    keys = document.data.keys() if isinstance(document.data, dict) else set()
    if "reference" not in keys and not HANDS_ON_KEYS.isdisjoint(keys):
        return _hands_on(document, names, path.parent)
    model = validate(SceneModel, document, names)
    try:
        return model.build().located(path.parent)
    except InputError as error:
        refuse([Problem(document.mark(()), (), str(error))])


def _hands_on(document: Document, names: Names, folder: Path) -> "HandsOnScene":
    """What the admittance needs is imported here only: the other scenes start faster without."""
    from scenarios.hands_on.scene_file import HandsOnModel

    model = validate(HandsOnModel, document, names)
    try:
        return model.build().located(folder)
    except InputError as error:
        refuse([Problem(document.mark(()), (), str(error))])


def dump_scene(scene: Scene) -> str:
    """The scene as YAML, on no base: what is loaded from it is equal to the scene.

    Raises
    ------
    InputError : what a file cannot hold: a text over 200 characters or not printable, more than 1000 items.
    """
    return write(scene_data(scene))


def _with_bases(path: Path, users: tuple[Path, ...]) -> Document:
    """The document of a file, with the keys of its base that it does not give itself."""
    document = read(path)
    if not isinstance(document.data, dict) or "base" not in document.data:
        return document
    try:
        base = beside(path, document.data["base"], (*users, path))
    except InputError as error:
        mark = document.mark(("base",))
        refuse([*document.problems, Problem(mark, ("base",), f"base: {error}")])
    below = _with_bases(base, (*users, path))
    if not isinstance(below.data, dict):
        refuse([Problem(below.mark(()), (), f"expected keys and values, got {show(below.data)}")])
    own = {key: value for key, value in document.data.items() if key != "base"}
    inherited = {place: mark for place, mark in below.marks.items() if place and place[0] not in own}
    return Document(below.data | own, inherited | dict(document.marks), document.problems + below.problems)


def _names(data: Any, folder: Path) -> Names:
    """What the keys of a scene may refer to; the data need not be right, but an own robot that is must be buildable."""
    if not isinstance(data, dict):
        return {}
    names: Names = {
        "constraint": [name for name in declared_names(data.get("constraints")) if name is not None],
        "cloud": _clouds(data.get("anatomy")),
    }
    try:
        declared = robot_of(data.get("robot"))
    except ValueError:
        return names
    robot = entry_of(declared.located(folder) if isinstance(declared, OwnRobot) else declared).build()
    sliding = [joint for i, joint in enumerate(robot.joints, 1) if motion_axis(robot.model, i)[0]]
    own = {"frame": robot.frames, "joint": robot.joints, "sliding joint": sliding, "joint group": list(robot.groups)}
    return {**names, **own}


def _clouds(anatomy: Any) -> tuple[str, ...] | None:
    """Names of the parts of an anatomy, which need not be right; None where it does not say them."""
    if anatomy is None:
        return ()
    if not isinstance(anatomy, dict) or anatomy.get("kind") not in KINDS:
        return None
    return part_names(anatomy["kind"], anatomy.get("organ"), anatomy.get("vessels"))
