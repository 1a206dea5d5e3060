"""The table of pairs: what is in it, and what may be added."""

import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numba
import numpy as np
import pytest

from primitives.checks import Array
from primitives.compiled import JIT_DISABLED, compiled
from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Line, Point
from primitives.errors import InputError, UnknownNameError
from primitives.evaluate import evaluate
from primitives.intrinsics import PAIR_SIGNATURE
from primitives.pair import Pair
from primitives.plugins import Registry
from primitives.registry import pairs
from tests.primitives.arms import ARMS

ROOT = Path(__file__).parents[2]


@compiled(PAIR_SIGNATURE)
def height(a: Array, b: Array, gradient: Array) -> tuple[float, int]:
    """Of a point above the foot of another, along the other's line: no pair that is built in."""
    gradient[:] = 0.0
    distance = 0.0
    for i in range(3):
        distance += (a[i] - b[i]) * b[3 + i]
        gradient[i] = b[3 + i]
        gradient[6 + i] = -b[3 + i]
        gradient[9 + i] = a[i] - b[i]
    return distance, 0


@pytest.fixture
def mine() -> Iterator[Pair]:
    pair = pairs.register(Pair("point_line_height", "point", "line", "m", height))
    yield pair
    del pairs._things[pair.name]


def test_every_file_of_the_folder_is_a_pair_of_its_name() -> None:
    files = {f.stem for f in (ROOT / "primitives" / "pairs").glob("*.py")} - {"__init__"}
    assert set(pairs.names()) == files and list(pairs.names()) == sorted(files)
    for name in pairs.names():
        pair = pairs[name]
        assert pair.name == name and name.startswith(f"{pair.first}_{pair.second}")
        assert pair.unit == ("rad" if name == "line_line_angle" else "m")


def test_an_unknown_pair_names_the_nearest() -> None:
    with pytest.raises(UnknownNameError, match=r'unknown pair "point_lin"\. Did you mean "point_line"\?') as error:
        pairs["point_lin"]
    assert "segment_segment" in str(error.value)


def test_a_registered_pair_is_used_like_the_others(mine: Pair) -> None:
    assert mine.name in pairs.names() and pairs[mine.name] is mine
    robot, q = ARMS["six"].robot, np.array([0.3, -0.4, 0.5, 0.2, -0.1, 0.6])
    pole = Line.through([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    one = ConstraintSet([Constraint("up", Point.at([0, 0, 0], frame="frame6"), pole, "outside", 0.1, mine.name)])
    result, kinematics = evaluate(robot, one, q), robot.kinematics(q)
    assert result.margin[0] == pytest.approx(kinematics.translation("frame6")[2] - 0.1)
    np.testing.assert_allclose(result.jacobian[0], kinematics.jacobian("frame6")[2], atol=1e-15)


def test_a_taken_name_is_refused(mine: Pair) -> None:
    assert pairs.register(mine) is mine, "the same pair once more does no harm"
    for pair in (pairs["point_point"]._replace(unit="rad"), Pair(mine.name, "line", "line", "m", height)):
        with pytest.raises(InputError, match=f'pair "{pair.name}" is registered already; give yours another name'):
            pairs.register(pair)
    assert pairs["point_point"].unit == "m" and pairs[mine.name] is mine


def plain(a: Array, b: Array, gradient: Array) -> tuple[float, int]:
    return 0.0, 0


@pytest.mark.skipif(JIT_DISABLED, reason="kernels are Python functions then")
@pytest.mark.parametrize(
    "kernel",
    [plain, numba.njit(plain), numba.njit("float64(float64)")(lambda x: x), None],
    ids=["Python", "compiled when called", "of another signature", "none"],
)
def test_a_kernel_that_a_loop_cannot_call_is_refused(kernel: object) -> None:
    with pytest.raises(InputError, match=r'pair "x": its kernel is not compiled; decorate it with @compiled'):
        pairs.register(Pair("x", "point", "point", "m", kernel))  # type: ignore[arg-type]
    assert "x" not in pairs.names()


def test_what_is_no_pair_is_refused() -> None:
    for thing in ("point_point", None, height):
        with pytest.raises(InputError, match="expected a Pair"):
            pairs.register(thing)  # type: ignore[arg-type]
    with pytest.raises(InputError, match='expected the unit "m" or "rad", got \'mm\''):
        pairs.register(Pair("x", "point", "point", "mm", height))  # type: ignore[arg-type]


def test_a_folder_that_fails_to_load_fails_every_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not only the first time: the second asker would get the half of the table that was read before."""
    (tmp_path / "things").mkdir()
    (tmp_path / "things" / "__init__.py").write_text("")
    (tmp_path / "things" / "a.py").write_text("THING = type('Thing', (), {'name': 'a'})()")
    (tmp_path / "things" / "b.py").write_text("raise RuntimeError('broken')")
    monkeypatch.syspath_prepend(tmp_path)
    package = ModuleType("things")
    package.__path__ = [str(tmp_path / "things")]
    monkeypatch.setitem(sys.modules, "things", package)
    things: Registry[object] = Registry("thing", package, "THING", lambda thing: None)
    for _ in range(2):
        with pytest.raises(RuntimeError, match="broken"):
            things.names()
    (tmp_path / "things" / "b.py").write_text("THING = type('Thing', (), {'name': 'b'})()")
    assert things.names() == ("a", "b")
    monkeypatch.delitem(sys.modules, "things.a")
    monkeypatch.delitem(sys.modules, "things.b")
