"""Compiled code on disk: never stale, never lost without need, never in anybody's way."""

import gc
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from primitives import compiled as module
from primitives.compiled import compiled
from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Element, Line, Plane, Point, Segment
from primitives.evaluate import evaluate, evaluate_margins
from primitives.intrinsics import PAIR_SIGNATURE, address_of
from primitives.registry import pairs
from tests.primitives.arms import ARMS

ROOT = Path(__file__).parents[2]

INNER = """
from primitives.compiled import compiled

@compiled("float64(float64)")
def inner(x):
    return {} * x
"""
CALLER = """
from primitives.compiled import compiled
from {} import inner

@compiled("float64(float64)")
def outer(x):
    return inner(x)
"""
BY_ATTRIBUTE = """
from primitives.compiled import compiled
import {} as far

@compiled("float64(float64)")
def outer(x):
    return far.inner(x)
"""
PLAIN = """
import numba
from far import inner

@numba.njit("float64(float64)", cache=True)
def outer(x):
    return inner(x)
"""
MAIN = """
import numpy as np
from own.deep.caller import outer as nested
from own.across import outer as across
from own.attribute import outer as attribute
from own.kernels import outer as kernels
from own.plain import outer as plain
from helped import outer as helped
from primitives.pairs.point_point import point_point
status = point_point(np.zeros(8), np.eye(8)[0], np.zeros(12))[1]
print(nested(1.0), across(1.0), attribute(1.0), kernels(1.0), helped(1.0), plain(1.0), status)
"""


class Project:
    """A copy of what compiles in `primitives`, and packages beside it whose functions call each other."""

    def __init__(self, root: Path) -> None:
        self.root, self.cache = root, root / "cache"
        (root / "primitives" / "pairs").mkdir(parents=True)
        self.write("primitives/__init__.py", "")
        for name in (
            "checks",
            "compiled",
            "intrinsics",
            "errors",
            "pair",
            "vectors",
            "pairs/__init__",
            "pairs/point_point",
        ):
            shutil.copy(ROOT / "primitives" / f"{name}.py", root / "primitives" / f"{name}.py")
        for inner in ("own/inner", "far", "primitives/pairs/extra", "helper"):
            self.write(f"{inner}.py", INNER.format(2.0))
        for package in ("own", "own/deep"):
            self.write(f"{package}/__init__.py", "")
        self.write("own/deep/caller.py", CALLER.format("own.inner"))
        self.write("own/across.py", CALLER.format("far"))
        self.write("own/attribute.py", BY_ATTRIBUTE.format("far"))
        self.write("own/kernels.py", CALLER.format("primitives.pairs.extra"))
        self.write("own/plain.py", PLAIN)
        self.write("helped.py", CALLER.format("helper"))
        self.write("main.py", MAIN)

    def write(self, path: str, text: str) -> None:
        (self.root / path).parent.mkdir(exist_ok=True, parents=True)
        (self.root / path).write_text(text)

    def run(self, *arguments: str, text: str = "", **changes: str) -> subprocess.CompletedProcess[str]:
        environment = {k: v for k, v in os.environ.items() if not k.startswith("NUMBA")}
        environment |= {"PYTHONPATH": str(self.root), "NUMBA_CACHE_DIR": str(self.cache)} | changes
        command = [sys.executable, *(arguments or ("main.py",))]
        return subprocess.run(command, cwd=self.root, env=environment, input=text, capture_output=True, text=True)

    def numbers(self) -> tuple[list[float], str]:
        """What main.py prints, and its notices."""
        done = self.run()
        assert done.returncode == 0, done.stderr
        return [float(word) for word in done.stdout.split()], done.stderr

    def kept(self) -> dict[Path, int]:
        return {f: f.stat().st_mtime_ns for f in self.cache.rglob("*.nb*")}


@pytest.fixture
def project(tmp_path: Path) -> Project:
    return Project(tmp_path)


def test_an_edit_in_another_file_is_never_missed(project: Project) -> None:
    """In another file of the package, of another package, beside a script, among the kernels, in a constant.

    The last but one number is numba's own cache, which misses it: should this ever change, `compiled` can go.
    """
    first, notice = project.numbers()
    assert first == [2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 0.0]
    assert notice.count("compiling once") == 1
    kept = project.kept()

    assert project.numbers() == (first, "")
    assert project.kept() == kept, "nothing was edited, so nothing is compiled"

    edited = list(first)
    for inner, outer in ((("own/inner", "helper"), (0, 4)), (("far",), (1, 2)), (("primitives/pairs/extra",), (3,))):
        for name in inner:
            project.write(f"{name}.py", INNER.format(30.0))
        for i in outer:
            edited[i] = 30.0
        assert project.numbers()[0] == edited, f"{inner} was edited"

    vectors = project.root / "primitives" / "vectors.py"
    text = vectors.read_text()
    vectors.write_text(text.replace("CONTACT: Final = 1e-9", "CONTACT: Final = 2.0"))
    assert vectors.read_text() != text
    assert project.numbers()[0] == [*edited[:-1], 1.0], "now everything nearer than 2 m is in contact"


def test_from_standard_input_it_compiles_and_keeps_nothing(project: Project) -> None:
    text = INNER.format(2.0) + "print(inner(1.0), bool(inner.overloads))"
    done = project.run("-", text=text)
    assert (done.returncode, done.stdout, done.stderr) == (0, "2.0 True\n", "")
    assert not project.kept()


def test_a_script_is_kept_too(project: Project) -> None:
    project.write("script.py", INNER.format(2.0) + "print(inner(1.0))")
    assert project.run("script.py").stdout == "2.0\n"
    kept = project.kept()
    assert len(kept) == 2
    again = project.run("script.py")
    assert (again.stdout, again.stderr) == ("2.0\n", "")
    assert project.kept() == kept


def test_where_nothing_can_be_kept_it_works_and_says_so(project: Project) -> None:
    project.write("script.py", INNER.format(2.0) + "print(inner(1.0))")
    (project.root / "file").write_text("in the way")
    done = project.run("script.py", NUMBA_CACHE_DIR=str(project.root / "file" / "below"))
    assert (done.returncode, done.stdout) == (0, "2.0\n")
    assert done.stderr.count("compiled code is not kept") == 1


NO_SPACE = "import resource\nresource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))\n"
"""No file can grow: a full disk."""


@pytest.mark.skipif(sys.platform == "win32", reason="there is no limit of the size of files to stand for a full disk")
def test_on_a_full_disk_it_works_and_says_so(project: Project) -> None:
    two = INNER.format(2.0) + INNER.format(3.0).replace("inner", "other")
    project.write("script.py", NO_SPACE + two + "print(inner(1.0), other(1.0))")
    done = project.run("script.py", PYTHONDONTWRITEBYTECODE="1")
    assert (done.returncode, done.stdout) == (0, "2.0 3.0\n"), done.stderr
    assert done.stderr.count("compiled code is not kept") == 1


def test_only_old_folders_of_the_same_package_are_forgotten(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """What others keep under NUMBA_CACHE_DIR, and what other packages of ours keep, stays."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    mine = tmp_path / "active-constraints"
    others = [tmp_path / "somebody", mine / "vfi", mine / f"own-pairs-{'0' * 20}", mine / f"vfi-{'0' * 20}"]
    for folder in others:
        folder.mkdir(parents=True)
        os.utime(folder, (0, 0))
    folder_of = module._folder.__wrapped__
    made = [folder_of("own", f"{i:020x}") for i in range(module.KEPT_CACHES + 2)]
    for age, folder in enumerate(reversed(made)):
        if folder.exists():
            os.utime(folder, (1e9 - age, 1e9 - age))
    assert [f.exists() for f in made] == [False] * 2 + [True] * module.KEPT_CACHES
    assert all(folder.exists() for folder in others)
    folder_of("own", made[2].name[4:])  # used again, so no longer the oldest
    folder_of("own", "f" * 20)
    assert [f.exists() for f in made[2:5]] == [True, False, True]
    assert "not kept" not in capsys.readouterr().err


def test_two_processes_may_make_the_folder_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    module._folder.__wrapped__("own", "0" * 20)
    monkeypatch.setattr(Path, "exists", lambda self: False)  # as seen just before the other made it
    assert module._folder.__wrapped__("own", "0" * 20) is not None
    assert "not kept" not in capsys.readouterr().err


@pytest.mark.skipif(module.JIT_DISABLED, reason="nothing is compiled")
@pytest.mark.parametrize("name", pairs.names())
def test_strided_and_read_only_arrays_are_refused_and_not_compiled_for(name: str) -> None:
    kernel = pairs[name].kernel
    good, strided, frozen = np.eye(8)[0], np.zeros(16)[::2], np.zeros(8)
    frozen.setflags(write=False)
    for bad in (strided, frozen, good.astype(np.float32), np.zeros((8, 1)), [0.0] * 8):
        with pytest.raises(TypeError, match="No matching definition"):
            kernel(bad, good, np.empty(12))  # type: ignore[arg-type]
    assert len(kernel.overloads) == 1  # type: ignore[attr-defined]


def made_here() -> int:
    def one(a, b, gradient):  # type: ignore[no-untyped-def]
        gradient[:] = 0.0
        return 1.0, 0

    return address_of(compiled(PAIR_SIGNATURE)(one))


def test_a_kernel_lives_as_long_as_its_address() -> None:
    address = made_here()
    gc.collect()
    distance, margin, status = np.zeros(1), np.zeros(1), np.zeros(1, dtype=np.int64)
    evaluate_margins(
        np.array([address]),
        np.zeros((1, 2), dtype=np.int64),
        np.zeros((2, 8)),
        np.ones(1),
        np.zeros(1),
        np.zeros((1, 12)),
        distance,
        margin,
        status,
    )
    assert distance[0] == 1.0
    assert address_of(pairs["point_line"].kernel) == address_of(pairs["point_line"].kernel)


def sample() -> dict[str, Any]:
    """Every pair once, on an arm: what must not depend on being compiled."""
    frame, q = "frame8", np.array([0.01, -0.02, 0.3, -0.2, 0.2, 0.5, 0.4, -0.3])
    one: dict[str, Element] = {
        "point": Point.at([0.1, 0.2, 0.3], frame=frame),
        "line": Line.through([0.1, 0.2, 0.3], [1.0, 2.0, -1.0], frame=frame),
        "segment": Segment.between([0.0, 0.1, 0.0], [0.1, 0.2, 0.3], frame=frame),
    }
    other: dict[str, Element] = {
        "point": Point.at([0.3, -0.2, 0.1]),
        "line": Line.through([0.3, -0.2, 0.1], [0.0, 1.0, 1.0]),
        "plane": Plane.through([0.3, -0.2, 0.1], [0.0, 1.0, 1.0]),
        "segment": Segment.between([0.3, -0.2, 0.1], [0.4, 0.4, 0.1]),
    }
    chosen = [Constraint(n, one[pairs[n].first], other[pairs[n].second], "inside", 0.1, n) for n in pairs.names()]
    result = evaluate(ARMS["neuro8"].robot, ConstraintSet(chosen), q, velocity=0.1 * q)
    return {k: v if k == "names" else v.tolist() for k, v in result._asdict().items()}


def test_without_compilation_the_numbers_are_the_same() -> None:
    code = "import json, tests.primitives.test_compiled as t; print(json.dumps([t.module.JIT_DISABLED, t.sample()]))"
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    disabled, plain = json.loads(done.stdout)
    assert disabled
    for name, value in sample().items():
        if name == "names":
            assert plain[name] == list(value)
        else:
            np.testing.assert_allclose(plain[name], value, rtol=1e-13, atol=1e-16)
