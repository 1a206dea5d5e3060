"""The one decorator that compiles.

numba's disk cache looks at the file of a function only: after an edit in a function that another file calls, the
caller would be taken from the cache with the old formula inside. So nothing else in this project compiles. Here the
cache folder is named by a digest of every source that a function may inline: those of `primitives`, those of its own
package and of the packages whose compiled functions it calls, and the versions of numba, llvmlite and Python.

Signatures are explicit. A read-only or strided array is another type and is refused by numba's dispatcher instead of
being compiled for inside a running loop; `primitives.checks` coerces at the border.
"""

import functools
import hashlib
import os
import platform
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar, cast

import llvmlite
import numba
from numba.core import config as numba_config
from numba.core.dispatcher import Dispatcher

F = TypeVar("F", bound=Callable[..., Any])
config: Any = numba_config

JIT_DISABLED: bool = bool(config.DISABLE_JIT)
"""True under NUMBA_DISABLE_JIT=1: every kernel then runs as Python, so that coverage and mutation can see it."""

KEPT_CACHES = 6
"""Cache folders that are kept for each package; older ones belong to sources that have changed since."""

_HERE = Path(__file__).parent


@functools.cache
def _sources_in(folder: Path) -> tuple[Path, ...]:
    return tuple(sorted(folder.rglob("*.py")))


def _home(function: Callable[..., Any]) -> tuple[str, tuple[Path, ...]]:
    """Name and sources of the top-level package that a function is of, or of its file where there is none."""
    package = function.__module__.partition(".")[0]
    folders = getattr(sys.modules.get(package), "__path__", ())
    if folders:
        return package, tuple(source for folder in folders for source in _sources_in(Path(folder)))
    file = Path(function.__code__.co_filename)
    return file.stem, (file,)


def _inlined(function: Callable[..., Any]) -> list[Callable[..., Any]]:
    """Compiled functions that a function calls by name, or as attributes of a module."""
    names = function.__code__.co_names
    near = [function.__globals__.get(name) for name in names]
    far = [getattr(module, name, None) for module in near if isinstance(module, ModuleType) for name in names]
    return [f.py_func for f in (*near, *far) if isinstance(f, Dispatcher)]


def _sources(function: Callable[..., Any]) -> tuple[Path, ...]:
    found = dict.fromkeys((*_sources_in(_HERE), *_home(function)[1]))
    for inner in _inlined(function):
        if Path(inner.__code__.co_filename) not in found:
            found |= dict.fromkeys(_sources(inner))
    return tuple(found)


@functools.cache
def _digest_of(sources: tuple[Path, ...]) -> str:
    digest = hashlib.sha256()
    for version in (numba.__version__, llvmlite.__version__, platform.python_version()):
        digest.update(version.encode())
    for source in sources:
        digest.update(source.name.encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:20]


def _cache_root() -> Path:
    if given := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(given) / "active-constraints"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "active-constraints"


def _forget_old(root: Path, name: str) -> None:
    """Remove all but the latest folders of one package; nothing else that lies beside them."""
    folders = [f for f in root.glob(f"{name}-*") if len(f.name) == len(name) + 21 and f.is_dir()]
    for folder in sorted(folders, key=lambda f: f.stat().st_mtime, reverse=True)[KEPT_CACHES:]:
        shutil.rmtree(folder, ignore_errors=True)


@functools.cache
def _folder(name: str, digest: str) -> Path | None:
    """The cache folder of a package's digest, made if need be; None where nothing can be written."""
    try:
        folder = _cache_root() / f"{name}-{digest}"
        new = not folder.exists()
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        if new:
            _announce()
            _forget_old(folder.parent, name)
    except (OSError, RuntimeError) as error:
        _not_kept(getattr(error, "strerror", None) or str(error))
        return None
    return folder


@functools.cache
def _not_kept(reason: str) -> None:
    print(f"active-constraints: compiled code is not kept, its folder cannot be written ({reason})", file=sys.stderr)


@functools.cache
def _announce() -> None:
    print("active-constraints: compiling once, a minute or two", file=sys.stderr, flush=True)


def compiled(signature: str) -> Callable[[F], F]:
    """Compile a function for one explicit numba signature and keep the result on disk.

    Parameters
    ----------
    signature : numba signature, e.g. ``"float64(float64[::1], float64[:,::1])"``.

    Returns
    -------
    A decorator. Division by zero follows NumPy (inf or nan) instead of raising, fast-math is off, and the GIL is kept.
    """

    def decorate(function: F) -> F:
        if JIT_DISABLED:
            return function
        on_disk = Path(function.__code__.co_filename).exists()
        folder = _folder(_home(function)[0], _digest_of(_sources(function))) if on_disk else None
        before = config.CACHE_DIR
        config.CACHE_DIR = str(folder or "")
        try:
            return cast(F, numba.njit(signature, cache=folder is not None, error_model="numpy")(function))
        except OSError as error:
            _not_kept(getattr(error, "strerror", None) or str(error))
            return cast(F, numba.njit(signature, error_model="numpy")(function))
        finally:
            config.CACHE_DIR = before

    return decorate
