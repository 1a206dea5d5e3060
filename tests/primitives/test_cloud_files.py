"""Files of geometry: what is written is read, trimesh agrees, and nothing that is broken comes through."""

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from primitives.compiled import JIT_DISABLED
from primitives.errors import FileError, UnknownNameError
from primitives.files import raw as raw_module
from primitives.files.mesh_file import SUFFIXES, read_surface
from primitives.files.pcd import decompress
from primitives.surface import Surface
from tests.primitives import geometry_files as made
from tests.primitives.geometry_files import FACES, VERTICES, WHOLE

KIDNEY = Path(__file__).parents[2].parent / "shared" / "data" / "kidney"
BROKEN = {name: (content, said) for name, content, said in made.broken()}


def write(folder: Path, name: str, content: bytes) -> Path:
    path = folder / name
    path.write_bytes(content)
    return path


def triangles(surface: Surface) -> Any:
    """Corners of all triangles, in an order of their own."""
    corners = surface.triangles.reshape(-1, 9)
    return corners[np.lexsort(corners.T)]


EXPECTED = triangles(Surface(VERTICES, FACES))


@pytest.mark.parametrize("name", [n for n in WHOLE if not n.endswith((".pcd", ".glb"))])
def test_triangles_are_read_as_they_were_written(name: str, tmp_path: Path) -> None:
    surface = read_surface(write(tmp_path, name, WHOLE[name]))
    np.testing.assert_array_equal(triangles(surface), EXPECTED)
    assert len(surface.vertices) == 4


@pytest.mark.parametrize("name", [n for n in WHOLE if n.endswith(".pcd")])
def test_points_are_read_as_they_were_written(name: str, tmp_path: Path) -> None:
    surface = read_surface(write(tmp_path, name, WHOLE[name]))
    np.testing.assert_array_equal(surface.vertices[:4], VERTICES)
    assert len(surface.vertices) == (200 if name == "packed.pcd" else 4)
    assert surface.faces.shape == (0, 3)


@pytest.mark.parametrize("stride", [12, 20])
@pytest.mark.parametrize("index_type", [5121, 5123, 5125])
def test_a_glb_shows_each_node_where_its_transforms_put_it(stride: int, index_type: int, tmp_path: Path) -> None:
    surface = read_surface(write(tmp_path, "one.glb", made.glb(stride=stride, index_type=index_type)))
    turned = 2.0 * VERTICES @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]).T + [1.0, 2.0, 3.0]
    assert len(surface.vertices) == 8
    first, second = surface.triangles.reshape(2, 4, 3, 3)[:: -1 if surface.vertices[0, 2] > 1.0 else 1]
    np.testing.assert_array_equal(first, VERTICES[FACES])
    np.testing.assert_allclose(second, turned[FACES], atol=1e-15)


def test_a_matrix_of_a_glb_is_given_column_by_column(tmp_path: Path) -> None:
    def change(content: Any) -> None:
        content["nodes"] = [{"mesh": 0, "matrix": [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]}]
        del content["scenes"], content["scene"]

    surface = read_surface(write(tmp_path, "one.glb", made.glb(change=change)))
    expected = VERTICES @ np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]) + [5.0, 6.0, 7.0]
    np.testing.assert_array_equal(surface.vertices, expected)


def test_polygons_become_fans(tmp_path: Path) -> None:
    mixed = [[0, 1, 2], [0, 1, 2, 3]]
    for name, content in (
        ("a.ply", made.ply(faces=mixed)),
        ("b.ply", made.ply("<", faces=mixed)),
        ("c.ply", made.ply(">", faces=mixed)),
        ("d.obj", made.obj(faces=mixed)),
    ):
        assert read_surface(write(tmp_path, name, content)).faces.tolist() == [[0, 1, 2], [0, 1, 2], [0, 2, 3]]
    for name, content in (("e.ply", made.ply(faces=mixed[1:])), ("f.ply", made.ply("<", faces=mixed[1:]))):
        assert read_surface(write(tmp_path, name, content)).faces.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_indices_of_an_obj_count_back_from_the_last_vertex(tmp_path: Path) -> None:
    content = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 5 5\nf -1 1 2\n"
    assert read_surface(write(tmp_path, "a.obj", content)).faces.tolist() == [[0, 1, 2], [3, 0, 1]]


@pytest.mark.parametrize(("unit", "size"), [("m", 1.0), ("cm", 0.01), ("mm", 0.001)])
def test_the_unit_scales_to_metres(unit: str, size: float, tmp_path: Path) -> None:
    path = write(tmp_path, "a.ply", made.ply())
    np.testing.assert_array_equal(read_surface(path, unit=unit).vertices, VERTICES * size)


def test_an_unknown_unit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="cm, m, mm"):
        read_surface(write(tmp_path, "a.ply", made.ply()), unit="inch")


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_file_is_an_error_that_names_it(name: str, tmp_path: Path) -> None:
    content, said = BROKEN[name]
    path = write(tmp_path, name, content)
    start = time.perf_counter()
    with pytest.raises(FileError, match=said) as caught:
        read_surface(path)
    assert str(caught.value).startswith(str(path))
    assert len(str(caught.value)) < 700
    assert time.perf_counter() - start < 2.0


def test_there_are_enough_broken_files() -> None:
    assert len(BROKEN) >= 40
    assert {Path(name).suffix for name in BROKEN} > set(SUFFIXES)


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="no such file"):
        read_surface(tmp_path / "missing.ply")
    (tmp_path / "folder.ply").mkdir()
    with pytest.raises(FileError, match="is a folder"):
        read_surface(tmp_path / "folder.ply")
    with pytest.raises(FileError, match="no ordinary file"):
        read_surface("/dev/zero")
    with pytest.raises(FileError, match="cannot be read"):
        read_surface("a\0b.ply")


def test_a_file_that_is_too_large_is_not_read_to_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(raw_module, "MAX_BYTES", 2**20)
    path = write(tmp_path, "a.stl", b"")
    with path.open("wb") as stream:
        stream.truncate(2**40)
    with pytest.raises(FileError, match="larger than 1 MiB"):
        read_surface(path)


def test_mixed_polygons_have_a_limit_in_number(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(raw_module, "MAX_POLYGONS", 1)
    for order in ("ascii", "<"):
        with pytest.raises(FileError, match="triangulate"):
            read_surface(write(tmp_path, "a.ply", made.ply(order, faces=[[0, 1, 2], [0, 1, 2, 3]])))


@pytest.mark.parametrize("suffix", ["ply", "stl", "obj", "glb"])
def test_trimesh_writes_what_is_read_here(suffix: str, tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh", reason="trimesh is the oracle of this test")
    mesh = trimesh.creation.icosphere(2, radius=0.05)
    mesh.apply_translation([0.1, -0.2, 0.3])
    scene: Any = mesh
    if suffix == "glb":
        scene = trimesh.Scene()
        for i in range(3):
            pose = trimesh.transformations.rotation_matrix(0.5 + i, [1.0, 2.0, i], [0.1, 0.0, 0.2 * i])
            scene.add_geometry(mesh, transform=pose)
        mesh = scene.to_mesh()
    scene.export(tmp_path / f"a.{suffix}")
    surface = read_surface(tmp_path / f"a.{suffix}")
    assert surface.area == pytest.approx(mesh.area, rel=1e-5)
    assert len(surface.faces) == len(mesh.faces)
    np.testing.assert_allclose(surface.bounds, mesh.bounds, atol=1e-7)
    if suffix != "stl":
        order, other = np.lexsort(np.round(surface.vertices, 6).T), np.lexsort(np.round(mesh.vertices, 6).T)
        np.testing.assert_allclose(surface.vertices[order], mesh.vertices[other], atol=2e-7)


@pytest.mark.parametrize(
    ("name", "vertices", "faces"),
    [
        ("kidney_left.ply", 5427, 10850),
        ("renal_vessels_left.ply", 6827, 13285),
        ("renal_vessels_left.stl", 6805, 13285),
        ("renal_vessels_left_cloud.ply", 995, 0),
    ],
)
def test_real_anatomy_is_read(name: str, vertices: int, faces: int) -> None:
    if not KIDNEY.exists():
        pytest.skip(f"needs the files of {KIDNEY}")
    surface = read_surface(KIDNEY / name)
    assert (len(surface.vertices), len(surface.faces)) == (vertices, faces)
    assert 0.1 < np.ptp(surface.bounds, axis=0).max() < 0.12


def test_lzf_unpacks_what_overlaps_itself_and_never_leaves_its_arrays() -> None:
    data = b"abcabcabcabcabcabc" + bytes(700) + bytes(range(256)) * 3 + b"end"
    packed = np.frombuffer(made.lzf(data), dtype=np.uint8).copy()
    out = np.zeros(len(data), dtype=np.uint8)
    assert len(packed) < len(data) / 3
    assert decompress(packed, out) == len(data)
    assert out.tobytes() == data
    assert decompress(packed, np.zeros(len(data) - 1, dtype=np.uint8)) == -1
    rng = np.random.default_rng(2)
    for _ in range(30 if JIT_DISABLED else 3000):
        guarded = np.full(64 + 32, 7, dtype=np.uint8)
        status = decompress(rng.integers(0, 256, int(rng.integers(1, 40)), dtype=np.uint8), guarded[:64])
        assert -1 <= status <= 64
        assert (guarded[64:] == 7).all()


def mutated(rng: np.random.Generator, content: bytes) -> bytes:
    """The content with one of the things that happen to files."""
    data = bytearray(content)
    at, size = int(rng.integers(len(data))), int(rng.integers(1, 12))
    match int(rng.integers(6)):
        case 0:
            return bytes(data[:at])
        case 1:
            data[at : at + size] = rng.integers(0, 256, size, dtype=np.uint8).tobytes()
        case 2:
            del data[at : at + size]
        case 3:
            data[at:at] = data[int(rng.integers(len(data))) :][: 8 * size]
        case 4:
            data[at : at + 4] = rng.choice(np.array([0, 1, 2**31 - 1, 2**32 - 1], dtype="<u4"), 1).tobytes()
        case 5:
            digits = [i for i, c in enumerate(data[:800]) if 48 <= c < 58]
            if digits:
                data[int(rng.choice(digits))] = int(rng.integers(48, 58))
                data[int(rng.choice(digits)) :][:0] = b"99999999"
    return bytes(data)


def survive(count: int, folder: Path) -> None:
    """Read mutated files: each gives a finite surface or a FileError, within two seconds."""
    rng = np.random.default_rng(8)
    read = refused = 0
    for i in range(count):
        name = list(WHOLE)[i % len(WHOLE)]
        path = write(folder, name, mutated(rng, WHOLE[name]))
        start = time.perf_counter()
        try:
            surface = read_surface(path)
        except FileError as error:
            refused += 1
            assert str(error).startswith(str(path))
        else:
            read += 1
            assert np.isfinite(surface.vertices).all()
        assert time.perf_counter() - start < 2.0
    assert refused > count / 3
    assert read > count / 50


def test_mutated_files(tmp_path: Path) -> None:
    survive(520, tmp_path)


@pytest.mark.campaign
def test_ten_thousand_mutated_files(tmp_path: Path) -> None:
    survive(10_000, tmp_path)
