"""The scene that a trace was recorded in, from the trace alone."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from scenarios.analysis.trace import Trace
from scenarios.scene import Scene
from scenarios.scene_file import load_any

if TYPE_CHECKING:
    from scenarios.hands_on.scene import HandsOnScene


def resolved_scene(trace: Trace) -> "Scene | HandsOnScene":
    """The scene as the trace's header holds it.

    Raises
    ------
    FileError : what the header holds is no scene, or names files that are gone.
    """
    with TemporaryDirectory() as folder:
        file = Path(folder) / "resolved.yaml"
        file.write_text(trace.header["resolved_scene"], encoding="utf-8")
        return load_any(file)
