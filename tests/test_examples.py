"""Every example in docs/examples runs as it stands and prints what it promises."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
EXAMPLES = sorted((ROOT / "docs" / "examples").glob("[0-9]*.py"))


def output(example: Path) -> str:
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, str(example)], env=env, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_there_are_examples():
    assert [e.name[:2] for e in EXAMPLES][:7] == ["01", "02", "03", "04", "05", "06", "07"]


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda e: e.stem)
def test_example_runs(example):
    assert output(example).strip()


def test_own_robot_stops_at_the_table():
    text = output(ROOT / "docs/examples/01_own_robot.py")
    smallest = float(re.search(r"smallest (-?[\d.]+) mm", text)[1])
    height = float(re.search(r"at the end: ([\d.]+) mm", text)[1])
    assert smallest >= 0.0
    assert height == pytest.approx(110.0, abs=0.2)


def test_s5_in_python_violates_nothing():
    text = output(ROOT / "docs/examples/02_s5_in_python.py")
    assert "violated: [], infeasible cycles: 0" in text


def test_own_primitive_has_the_right_gradient():
    text = output(ROOT / "docs/examples/03_own_primitive.py")
    assert float(re.search(r"central differences: ([\d.e+-]+)", text)[1]) < 1e-8


def test_hand_is_stopped_before_the_ball():
    text = output(ROOT / "docs/examples/04_hands_on.py")
    assert "all cycles in RUN: True" in text
    smallest, rest = (float(x) for x in re.search(r"clearance ([\d.-]+) mm, at the end ([\d.-]+) mm", text).groups())
    assert 0.0 < smallest <= rest < 11.5
    assert float(re.search(r"port error ([\d.]+) um", text)[1]) < 1.0
    # At rest the repulsion holds what the hand pulls with, as hard as it can.
    assert float(re.search(r"at the end ([\d.]+) N", text)[1]) == pytest.approx(15.0, abs=0.02)
    assert float(re.search(r"excess ([\d.e+-]+) J", text)[1]) <= 1e-9


def test_own_solver_agrees_with_the_kernel():
    text = output(ROOT / "docs/examples/05_own_solver.py")
    assert "states: RUN;" in text
    assert float(re.search(r"multiplier of the floor ([\d.]+)", text)[1]) > 0.0
    assert float(re.search(r"from the kernel ([\d.e+-]+)", text)[1]) < 1e-9
    assert 0.0 <= float(re.search(r"at the end ([\d.-]+) mm", text)[1]) < 0.1


def test_own_hand_gives_up_at_the_ball_and_goes_back():
    text = output(ROOT / "docs/examples/06_own_hand.py")
    assert "all cycles in RUN: True" in text
    assert 0.0 < float(re.search(r"clearance ([\d.-]+) mm", text)[1]) < 11.5
    assert float(re.search(r"at the end ([\d.]+) mm", text)[1]) < 0.5


def test_robot_loop_stops_at_old_states_and_at_nothing_else():
    text = output(ROOT / "docs/examples/07_robot_loop.py")
    stops = re.findall(r"(HOLD|FAULT) since t = ([\d.]+) s, until it is acknowledged: (.*)", text)
    assert [(state, reason[:14]) for state, _, reason in stops] == [("HOLD", "q was measured")]
    assert 1.0 < float(stops[0][1]) < 1.03
    assert float(re.search(r"smallest margin ([\d.-]+) mm", text)[1]) >= 0.0
    assert float(re.search(r"at the end ([\d.]+) mm", text)[1]) == pytest.approx(110.0, abs=0.2)
