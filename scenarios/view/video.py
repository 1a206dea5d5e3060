"""A video of a run, from its trace."""

from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path

import numpy as np

from primitives.checks import known, number
from primitives.errors import FileError, InputError
from scenarios.analysis.trace import Trace
from scenarios.plants.obstacles import Cloud, Port
from scenarios.view import ViewError
from scenarios.view.canvas import Canvas
from scenarios.view.film import CAMERAS, Film

LARGEST = 4096
"""Pixels a side."""


def record(
    trace: Trace,
    out: str | Path,
    *,
    fps: float = 30.0,
    width: int = 1280,
    height: int = 720,
    camera: str = "tool",
    port: Port | None = None,
    clouds: Sequence[Cloud] = (),
    progress: Callable[[float], None] | None = None,
) -> int:
    """Write a video of a run in real time; returns the number of its frames.

    Parameters
    ----------
    trace : of a run on a robot with MJCF files. Its q are shown; nothing is simulated.
    out : file to write, .mp4; it appears when it is complete.
    fps : frames a second. width, height : pixels, even. camera : one of `CAMERAS`.
    port, clouds : shown beside what the constraints of the scene declare.
    progress : called with the share that is done, once a frame.

    Raises
    ------
    InputError, UnknownNameError : an option out of range, a trace without cycles or of another robot.
    FileError : the file cannot be written. ModelError : the robot has no MJCF.
    ViewError : no OpenGL library, or the extra "video" is not installed.
    """
    out = Path(out)
    fps = number(fps, "frames a second", positive=True)
    for name, value in (("width", width), ("height", height)):
        if not 16 <= value <= LARGEST or value % 2:
            raise InputError(f"{name} of the video: expected an even number from 16 to {LARGEST}, got {value}")
    known("camera", camera, CAMERAS)
    if out.suffix.lower() != ".mp4":
        raise InputError(f'video file: expected a name that ends in ".mp4", got "{out.name}"')
    if not out.parent.is_dir():
        raise FileError(str(out), "cannot be written: its folder does not exist; make it first")
    try:
        imageio = import_module("imageio.v2")
        import_module("imageio_ffmpeg")
    except ImportError as error:
        raise ViewError(f'a video takes the extra "video": pip install "active-constraints[video]" ({error})') from None
    film = Film(trace, (width, height), CAMERAS[camera], port, clouds)
    moments = np.arange(trace.t[0], trace.t[-1] + 0.5 / fps, 1.0 / fps)
    part = out.with_name(f".{out.stem}.part.mp4")
    try:
        with (
            Canvas(film.model, width, height) as canvas,
            imageio.get_writer(part, fps=fps, codec="libx264", quality=8, macro_block_size=2) as writer,
        ):
            for i, t in enumerate(moments):
                k = int(np.searchsorted(trace.t, t + 1e-9, side="right")) - 1
                writer.append_data(canvas.draw(film.scene(k), *film.text(k)))
                if progress is not None:
                    progress((i + 1) / len(moments))
        part.replace(out)
    except OSError as error:
        raise FileError(str(out), f"the video cannot be written ({' '.join(str(error).split())})") from None
    finally:
        part.unlink(missing_ok=True)
    return len(moments)
