"""Off-screen rendering with whatever OpenGL the machine has, no display needed."""

import os
import subprocess
import sys
from importlib import import_module
from types import TracebackType
from typing import Any, Self

import mujoco
import numpy as np

from scenarios.view import ViewError

BACKENDS = ("cgl",) if sys.platform == "darwin" else ("egl", "osmesa")
"""MuJoCo's ways to OpenGL without a window, in the order they are tried; the environment's MUJOCO_GL comes first."""
_PROBE_SECONDS = 60.0


def backend() -> str:
    """The first of `BACKENDS` that makes a context here, tried in a process of its own.

    PyOpenGL settles on one library for good when it is imported, so a failed try may not happen in this process.

    Raises
    ------
    ViewError : none works; names Debian's packages and what each try said.
    """
    settled, wanted = os.environ.get("PYOPENGL_PLATFORM", "").lower(), os.environ.get("MUJOCO_GL", "").lower()
    if settled in BACKENDS:
        choices: tuple[str, ...] = (settled,)
    else:
        choices = (wanted,) if wanted in BACKENDS else BACKENDS
    said = []
    for name in choices:
        failure = _failure(name)
        if not failure:
            return name
        said.append(f"{name}: {failure}")
    raise ViewError(
        "no OpenGL library renders off screen here. On Debian or Ubuntu run: apt-get install libegl1 libgl1 (or "
        f"libosmesa6). Tried {'; '.join(said)}"
    )


def _failure(name: str) -> str:
    """Why a back end makes no context, in one line; empty where it does."""
    code = f"from mujoco.{name} import GLContext; c = GLContext(16, 16); c.make_current(); c.free()"
    try:
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, timeout=_PROBE_SECONDS, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return " ".join(str(error).split())
    if done.returncode == 0:
        return ""
    return (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]


class Canvas:
    """A picture of fixed size that a MuJoCo scene is drawn on; use it in a ``with`` statement.

    Parameters
    ----------
    model : a `mujoco.MjModel` whose offwidth and offheight are at least the size.
    width, height : pixels.

    Raises
    ------
    ViewError : see `backend`.
    """

    def __init__(self, model: Any, width: int, height: int):
        self._context = import_module(f"mujoco.{backend()}").GLContext(width, height)
        self._context.make_current()
        self._renderer = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_150.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._renderer)
        self._frame = mujoco.MjrRect(0, 0, width, height)
        self._pixels = np.empty((height, width, 3), dtype=np.uint8)

    def draw(self, scene: Any, heading: str, lines: str) -> np.ndarray:
        """The picture (height, width, 3), uint8, of a `mujoco.MjvScene`, with text in two columns at its top left."""
        mujoco.mjr_render(self._frame, scene, self._renderer)
        font, place = mujoco.mjtFont.mjFONT_NORMAL.value, mujoco.mjtGridPos.mjGRID_TOPLEFT.value
        mujoco.mjr_overlay(font, place, self._frame, heading, lines, self._renderer)
        mujoco.mjr_readPixels(self._pixels, None, self._frame, self._renderer)
        return np.flipud(self._pixels).copy()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._renderer.free()
        self._context.free()
