"""Dual quaternion Jacobians against DQ Robotics' arms, the paper's own formulas and central differences."""

from collections.abc import Callable

import numpy as np
import pytest
from dqrobotics import C4, DQ, E_, D, P, cross, dot, k_
from dqrobotics.robot_modeling import DQ_Kinematics, DQ_SerialManipulatorDH, DQ_SerialManipulatorMDH
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from primitives import conversions
from primitives import dual_jacobians as dj
from primitives import dual_quaternion as dq

Array = NDArray[np.float64]
Arm = DQ_SerialManipulatorDH | DQ_SerialManipulatorMDH

H, Z = np.pi / 2, 0.0
MDH = np.array(  # theta, d, a, alpha, type of the 8-dof arm
    [
        [H, Z, Z, H, Z, Z, -H, Z],
        [Z, Z, Z, Z, Z, Z, Z, Z],
        [Z, Z, 0.05, 0.04, Z, Z, Z, 0.004],
        [-H, H, -H, H, H, Z, -H, H],
        [1, 1, 0, 0, 1, 0, 0, 0],
    ]
)
DH = np.array(  # theta, d, a, alpha, type of the LWR4+
    [
        np.zeros(7),
        [0.31, 0, 0.4, 0, 0.39, 0, 0],
        np.zeros(7),
        [H, -H, -H, H, H, -H, 0],
        np.zeros(7),
    ]
)
ARMS: dict[str, Arm] = {"8-dof arm": DQ_SerialManipulatorMDH(MDH), "LWR4+": DQ_SerialManipulatorDH(DH)}
LINE = conversions.line([0.02, -0.03, 0.1], [0.1, -0.3, 0.9])


def configurations() -> list[tuple[str, Array]]:
    """Joint positions, stretched out (q = 0), folded by pi, and at random."""
    rng = np.random.default_rng(5)
    return [
        (name, q)
        for name, arm in ARMS.items()
        for n in [arm.get_dim_configuration_space()]
        for q in [np.zeros(n), np.full(n, np.pi), np.full(n, 1e-9), *rng.uniform(-2.5, 2.5, (8, n))]
    ]


def geometric_jacobian(arm: Arm, q: Array) -> Array:
    """[linear; angular] from the joints' axes: z of frame i (modified DH) or of frame i - 1 (DH)."""
    n = len(q)
    modified = isinstance(arm, DQ_SerialManipulatorMDH)
    tip = arm.raw_fkm(q).translation().vec3()
    J = np.zeros((6, n))
    for i in range(n):
        frame = arm.raw_fkm(q, i) if modified else (arm.raw_fkm(q, i - 1) if i else DQ([1.0]))
        axis = (frame.P() * k_ * frame.P().conj()).vec3()
        if modified and MDH[4, i]:
            J[:3, i] = axis
        else:
            J[:3, i], J[3:, i] = np.cross(axis, tip - frame.translation().vec3()), axis
    return J


@pytest.fixture(params=configurations(), ids=lambda p: f"{p[0]} {np.round(p[1][:3], 2)}")
def arm_state(request: pytest.FixtureRequest) -> tuple[DQ, Array, Array]:
    """Pose and pose Jacobian of DQ Robotics, and a geometric Jacobian made without the latter."""
    name, q = request.param
    arm = ARMS[name]
    return arm.raw_fkm(q), arm.raw_pose_jacobian(q, len(q) - 1), geometric_jacobian(arm, q)


def close(got: Array, expected: Array, tolerance: float = 1e-12) -> None:
    assert got.shape == expected.shape
    np.testing.assert_allclose(got, expected, rtol=0.0, atol=tolerance)


def test_frame_jacobians_agree_with_dq_robotics(arm_state: tuple[DQ, Array, Array]) -> None:
    x, J_x, J = arm_state
    pose = x.vec8()
    close(dj.pose_jacobian(pose, J), J_x)
    close(dj.translation_jacobian(J), DQ_Kinematics.translation_jacobian(J_x, x))
    close(dj.rotation_jacobian(pose, J), DQ_Kinematics.rotation_jacobian(J_x))
    close(dj.line_jacobian(pose, J), DQ_Kinematics.line_jacobian(J_x, x, k_))
    close(dj.plane_jacobian(pose, J), DQ_Kinematics.plane_jacobian(J_x, x, k_))


def test_line_jacobian_is_the_papers(arm_state: tuple[DQ, Array, Array]) -> None:
    """(19) and the equation after it, read with J_r and J_t inside the braces."""
    x, J_x, J = arm_state
    r, t = x.P(), x.translation()
    J_r, J_t = DQ_Kinematics.rotation_jacobian(J_x), DQ_Kinematics.translation_jacobian(J_x, x)
    l = r * k_ * r.conj()
    J_rz = ((k_ * r.conj()).haminus4() + (r * k_).hamiplus4() @ C4()) @ J_r
    J_mz = ((l.haminus4() - l.hamiplus4()) @ J_t + (t.hamiplus4() - t.haminus4()) @ J_rz) / 2.0
    close(dj.line_jacobian(x.vec8(), J), np.vstack([J_rz, J_mz]))


def test_product_jacobians_lead_to_the_distance_of_dq_robotics(arm_state: tuple[DQ, Array, Array]) -> None:
    """(26), (28) and (29)-(33), with the minus of b that (30) defines."""
    x, _, J = arm_state
    l_z = x.P() * k_ * x.P().conj()
    l_z = l_z + E_ * cross(x.translation(), l_z)
    J_l, line = dj.line_jacobian(x.vec8(), J), DQ(LINE)
    J_inner, J_cross = dj.inner_product_jacobian(J_l, LINE), dj.cross_product_jacobian(J_l, LINE)
    close(J_inner, -0.5 * (line.hamiplus8() + line.haminus8()) @ J_l)
    close(J_cross, 0.5 * (line.haminus8() - line.hamiplus8()) @ J_l)
    for j in range(J.shape[1]):
        close(J_inner[:, j], dot(DQ(J_l[:, j]), line).vec8())
        close(J_cross[:, j], cross(DQ(J_l[:, j]), line).vec8())

    d_inner, p_cross = D(dot(l_z, line)).vec4(), P(cross(l_z, line)).vec4()
    top, bottom = np.linalg.norm(d_inner), np.linalg.norm(p_cross)
    assert top > 1e-4
    assert bottom > 1e-2
    a, b = 1.0 / bottom, -top / bottom**2
    J_d = a * d_inner @ J_inner[4:] / top + b * p_cross @ J_cross[:4] / bottom
    # DQ Robotics gives the Jacobian of the squared distance.
    J_squared = DQ_Kinematics.line_to_line_distance_jacobian(J_l, l_z, line)
    close(2.0 * (top / bottom) * J_d, J_squared.ravel(), 1e-10)


AXIS = np.array([2.0, -3.0, 6.0]) / 7.0
FRAMES = [
    (angle, sign, np.array(t))
    for angle in (0.0, 1e-12, 1e-6, 1.0, np.pi - 1e-9, np.pi, 5.0)
    for sign in (1.0, -1.0)
    for t in ([0.0, 0.0, 0.0], [0.1, -0.2, 0.4], [1e3, -2e3, 5e2])
]


def quantity(name: str, R: Array, t: Array, r: Array) -> Array:
    """What a Jacobian differentiates, written out with vectors."""
    z = R[:, 2]
    moved = np.r_[0.0, z, 0.0, np.cross(t, z)]
    parts: dict[str, Callable[[], Array]] = {
        "pose": lambda: (DQ(r) + 0.5 * E_ * DQ(np.r_[0.0, t]) * DQ(r)).vec8(),
        "rotation": lambda: r,
        "translation": lambda: np.r_[0.0, t],
        "line": lambda: moved,
        "plane": lambda: np.r_[0.0, z, t @ z, 0.0, 0.0, 0.0],
        "inner product": lambda: np.r_[z @ LINE[1:4], 0, 0, 0, z @ LINE[5:] + moved[5:] @ LINE[1:4], 0, 0, 0],
        "cross product": lambda: np.r_[
            0, np.cross(z, LINE[1:4]), 0, np.cross(z, LINE[5:]) + np.cross(moved[5:], LINE[1:4])
        ],
    }
    return parts[name]()


JACOBIANS: dict[str, Callable[[Array, Array], Array]] = {
    "pose": dj.pose_jacobian,
    "rotation": dj.rotation_jacobian,
    "translation": lambda x, J: dj.translation_jacobian(J),
    "line": dj.line_jacobian,
    "plane": dj.plane_jacobian,
    "inner product": lambda x, J: dj.inner_product_jacobian(dj.line_jacobian(x, J), LINE),
    "cross product": lambda x, J: dj.cross_product_jacobian(dj.line_jacobian(x, J), LINE),
}


@pytest.mark.parametrize("name", JACOBIANS)
@pytest.mark.parametrize("frame", FRAMES, ids=lambda f: f"angle {f[0]:g} sign {f[1]:+g} {f[2]}")
def test_central_differences(name: str, frame: tuple[float, float, Array]) -> None:
    angle, sign, t = frame
    J = np.random.default_rng(7).uniform(-1.0, 1.0, (6, 3))
    r = sign * np.r_[np.cos(angle / 2), np.sin(angle / 2) * AXIS]
    h = 1e-5
    expected = []
    for twist in J.T:
        ends = []
        for step in (h, -h):
            turn = Rotation.from_rotvec(step * twist[3:])
            moved_r = (DQ(turn.as_quat(scalar_first=True)) * DQ(r)).vec4()
            moved_R = Rotation.from_quat(moved_r, scalar_first=True).as_matrix()
            ends.append(quantity(name, moved_R, t + step * twist[:3], moved_r))
        expected.append((ends[0] - ends[1]) / (2.0 * h))
    x = dq.from_rotation_translation(r, t)
    close(JACOBIANS[name](x, J), np.array(expected).T, 1e-9 * max(1.0, float(np.abs(t).max())))


@pytest.mark.parametrize("n", [0, 1])
def test_arms_of_hardly_any_joint(n: int) -> None:
    x, J = dq.from_rotation_translation(np.array([1.0, 0, 0, 0]), np.ones(3)), np.ones((6, n))
    J_l = dj.line_jacobian(x, J)
    for got, rows in (
        (dj.pose_jacobian(x, J), 8),
        (dj.rotation_jacobian(x, J), 4),
        (dj.translation_jacobian(J), 4),
        (J_l, 8),
        (dj.plane_jacobian(x, J), 8),
        (dj.inner_product_jacobian(J_l, LINE), 8),
        (dj.cross_product_jacobian(J_l, LINE), 8),
    ):
        assert got.shape == (rows, n)
        assert got.flags.c_contiguous
