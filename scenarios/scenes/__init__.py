"""The scenes that can be named: the YAML files of this folder, those of installed plug-ins, those registered by hand.

A file of this folder that has no `name` is only the base of others; NAME.ROBOT.yaml is the scene NAME for another
robot. From outside, `register_scene(path)` or an entry point ``active_constraints.scenes`` that leads to a path adds
one. Importing this loads no robot and no compiler.
"""

from functools import cache
from importlib.metadata import entry_points
from importlib.resources import files
from pathlib import Path

from primitives.errors import InputError, UnknownNameError
from primitives.files.document import Mark, Problem, refuse
from primitives.files.yaml_file import read

FOLDER = Path(str(files(__name__)))

_registered: dict[str, Path] = {}


def _name(path: Path) -> str | None:
    """The name that a scene file gives itself; None for a file without one."""
    document = read(path)
    if document.problems:
        refuse(document.problems)
    name = document.data.get("name") if isinstance(document.data, dict) else None
    return name if isinstance(name, str) else None


@cache
def _built_in() -> dict[str, Path]:
    named = ((_name(path), path) for path in sorted(FOLDER.glob("*.yaml")) if "." not in path.stem)
    return {name: path for name, path in named if name is not None}


@cache
def _load_plugins() -> None:
    for plugin in entry_points(group="active_constraints.scenes"):
        try:
            path = Path(plugin.load())
        except Exception as error:
            raise InputError(
                f'entry point "{plugin.name}" of active_constraints.scenes: expected the path of a scene file, '
                f"{plugin.value} gives {type(error).__name__}: {error}"
            ) from error
        _add(path)


def _add(path: Path) -> str:
    name = _name(path)
    if name is None:
        refuse([Problem(Mark(str(path), 1), (), 'missing key "name"; a scene is registered under it')])
    if (_built_in() | _registered).get(name, path) != path:
        raise InputError(f'scene "{name}" of {path} is registered already; give yours another name')
    _registered[name] = path
    return name


def register_scene(path: str | Path) -> str:
    """Make the scene of a YAML file known under the file's `name`, which is returned.

    Raises
    ------
    FileError : the file cannot be read, or has no name.
    InputError : the name is taken.
    """
    _load_plugins()
    return _add(Path(path).absolute())


def scene_paths() -> dict[str, Path]:
    """The file of every known scene, by name, sorted."""
    _load_plugins()
    return dict(sorted((_built_in() | _registered).items()))


def scene_names() -> tuple[str, ...]:
    """Every known scene."""
    return tuple(scene_paths())


def scene_path(name: str, robot: str | None = None) -> Path:
    """The file of a scene, for that robot if it has one; raises UnknownNameError, which proposes the nearest name."""
    paths = scene_paths()
    if name not in paths:
        raise UnknownNameError("scene", name[:100], paths)
    variant = paths[name].with_name(f"{paths[name].stem}.{robot}.yaml")
    return variant if robot is not None and variant.exists() else paths[name]
