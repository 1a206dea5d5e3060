"""The one decorator that compiles, and the call through a table of addresses.

numba's disk cache looks at the file of a function only: after an edit in a function that another file calls, the
caller would be taken from the cache with the old formula inside. So nothing else in this project compiles. Here the
cache folder is named by a digest of every source that a function may inline: those of `primitives`, those of its own
package, and the versions of numba, llvmlite and Python.

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
from typing import Any, TypeVar, cast

import llvmlite
import numba
from numba.core import cgutils, types
from numba.core import config as numba_config
from numba.extending import intrinsic

F = TypeVar("F", bound=Callable[..., Any])
config: Any = numba_config

JIT_DISABLED: bool = bool(config.DISABLE_JIT)
"""True under NUMBA_DISABLE_JIT=1: every kernel then runs as Python, so that coverage and mutation can see it."""

KEPT_CACHES = 6
"""Cache folders that are kept; older ones belong to sources that have changed since."""

_HERE = Path(__file__).parent


def _sources(function: Callable[..., Any]) -> list[Path]:
    file = Path(function.__code__.co_filename)
    package = sys.modules[function.__module__].__package__ if function.__module__ in sys.modules else None
    own = sorted(file.parent.rglob("*.py")) if package else [file]
    return [*sorted(_HERE.glob("*.py")), *own]


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
        return Path(given)
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "active-constraints"


def _forget_old(root: Path) -> None:
    folders = sorted((f for f in root.iterdir() if f.is_dir()), key=lambda f: f.stat().st_mtime, reverse=True)
    for folder in folders[KEPT_CACHES:]:
        shutil.rmtree(folder, ignore_errors=True)


@functools.cache
def _folder(digest: str) -> Path | None:
    """The cache folder of a digest, made if need be; None where nothing can be written."""
    folder = _cache_root() / digest
    try:
        if folder.exists():
            os.utime(folder)
        else:
            folder.mkdir(parents=True)
            _announce()
            _forget_old(folder.parent)
    except OSError as error:
        print(f"active-constraints: compiled code is not kept, {folder} is not writable ({error})", file=sys.stderr)
        return None
    return folder


@functools.cache
def _announce() -> None:
    print("active-constraints: compiling once, about 30 s", file=sys.stderr, flush=True)


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
        folder = _folder(_digest_of(tuple(_sources(function)))) if on_disk else None
        before = config.CACHE_DIR
        config.CACHE_DIR = str(folder or "")
        try:
            return cast(F, numba.njit(signature, cache=folder is not None, error_model="numpy")(function))
        finally:
            config.CACHE_DIR = before

    return decorate


_VECTOR = types.Array(types.float64, 1, "C")
_PAIR_ARGUMENTS = (_VECTOR, _VECTOR, _VECTOR)
_PAIR_RESULT = types.Tuple((types.float64, types.int64))

PAIR_SIGNATURE = "Tuple((float64, int64))(float64[::1], float64[::1], float64[::1])"
"""Signature shared by the kernels of all pairs: (a, b, gradient) -> (distance, status)."""

_by_address: dict[int, Callable[..., Any]] = {}


def address_of(kernel: Callable[..., Any]) -> int:
    """Address by which compiled loops call a pair's kernel; the dispatcher is kept alive for good.

    Under NUMBA_DISABLE_JIT it is a number that `call_pair` looks the Python function up by.
    """
    if JIT_DISABLED:
        address = id(kernel)
    else:
        result = cast(Any, kernel).overloads[_PAIR_ARGUMENTS]
        address = int(result.library.get_pointer_to_function(result.fndesc.llvm_func_name))
    _by_address[address] = kernel
    return address


if JIT_DISABLED:

    def call_pair(address: int, a: Any, b: Any, gradient: Any) -> Any:
        """Call the kernel that stands at an address."""
        return _by_address[int(address)](a, b, gradient)

else:

    @intrinsic
    def call_pair(typing_context: Any, address: Any, a: Any, b: Any, gradient: Any) -> Any:
        """Call the kernel that stands at an address, in numba's own calling convention."""

        def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            function_type = context.call_conv.get_function_type(_PAIR_RESULT, _PAIR_ARGUMENTS)
            function = builder.inttoptr(arguments[0], function_type.as_pointer())
            status, result = context.call_conv.call_function(
                builder, function, _PAIR_RESULT, _PAIR_ARGUMENTS, arguments[1:]
            )
            with cgutils.if_unlikely(builder, status.is_error):
                context.call_conv.return_status_propagate(builder, status)
            return result

        return _PAIR_RESULT(types.int64, *_PAIR_ARGUMENTS), codegen
