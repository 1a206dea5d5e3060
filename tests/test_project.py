"""The project itself: the diamond of imports, what the wheel holds, the faces of the rooms."""

import subprocess
import sys
import zipfile
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
ROOMS = ("primitives", "vfi", "admittance", "scenarios")


def call(*arguments: str, cwd: Path = ROOT, **environment: str) -> subprocess.CompletedProcess[str]:
    import os

    env = {**os.environ, **environment}
    return subprocess.run(arguments, cwd=cwd, env=env, capture_output=True, text=True, timeout=300)


def test_imports_follow_the_diamond():
    done = call(str(Path(sys.executable).with_name("lint-imports")))
    assert done.returncode == 0, done.stdout + done.stderr
    assert "1 kept, 0 broken" in done.stdout


def test_wheel_holds_the_four_rooms_with_their_data_and_nothing_else(tmp_path):
    done = call(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path))
    assert done.returncode == 0, done.stderr
    (wheel,) = tmp_path.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    tops = {n.split("/")[0] for n in names}
    assert tops == {*ROOMS, next(t for t in tops if t.endswith(".dist-info"))}
    sources = {
        str(p.relative_to(ROOT))
        for room in ROOMS
        for p in (ROOT / room).rglob("*")
        if (p.is_file() and p.suffix in (".py", ".pyi", ".typed", ".urdf", ".yaml", ".xml")) or p.name == "py.typed"
    }
    missing = {s for s in sources if s not in names}
    assert not missing
    for room in ROOMS:
        assert f"{room}/py.typed" in names
    assert "scenarios/CITATION.cff" in names


@pytest.mark.parametrize("room", ["primitives", "vfi", "scenarios"])
def test_face_of_a_room_gives_every_name_it_lists(room):
    face = import_module(room)
    assert face.__all__
    for name in face.__all__:
        assert getattr(face, name) is not None


@pytest.mark.parametrize("room", ROOMS)
def test_foreign_sister_is_refused_with_both_paths(room, tmp_path):
    """A package of the same name that comes first on sys.path must not be taken for ours."""
    sister = next(r for r in ROOMS if r != room)
    foreign = tmp_path / sister
    foreign.mkdir()
    (foreign / "__init__.py").write_text("")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import {sister}; import {room}"
    done = call(sys.executable, "-c", code, cwd=ROOT, PYTHONPATH=str(ROOT))
    assert done.returncode != 0
    assert "ImportError" in done.stderr
    assert str(foreign) in done.stderr
    assert str(ROOT / room) in done.stderr


def test_help_loads_no_heavy_library():
    code = (
        "import sys\nfrom scenarios.cli import app\nfrom typer.testing import CliRunner\n"
        "assert CliRunner().invoke(app, ['--help']).exit_code == 0\n"
        "heavy = {'numba', 'pinocchio', 'mujoco', 'matplotlib', 'scipy', 'highspy', 'numpy'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    done = call(sys.executable, "-c", code)
    assert done.returncode == 0, done.stderr
