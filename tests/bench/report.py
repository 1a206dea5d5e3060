"""One table for people and one JSON for programs."""

import json
import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from tests.bench import admittance_bench

OUT = "ACTIVE_CONSTRAINTS_BENCH"
"""Environment variable: the folder that bench.json goes to; default runs/bench."""
PACKAGES = ("numpy", "numba", "dqrobotics", "pin", "pin-pink", "mink", "mujoco", "daqp", "quadprog", "qpsolvers")


def machine():
    """Where and with what this was measured."""
    versions = {}
    for package in PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            versions[package] = None
    cpuinfo = Path("/proc/cpuinfo")
    named = cpuinfo.read_text().partition("model name")[2].partition("\n")[0] if cpuinfo.exists() else ""
    return {
        "python": platform.python_version(),
        "system": platform.platform(),
        "processor": named.strip("\t: "),
        "cores": os.cpu_count(),
        "load": [round(x, 2) for x in os.getloadavg()],
        "versions": versions,
    }


def table(result):
    """The lines of the table: ratios first, then microseconds, then margins and tracking in mm."""
    head = f"{'':<24}{'ratio':>7}{'no-ops':>8}" + "".join(
        f"{c:>9}" for c in ("p5", "median", "mean", "cold", "p99", "p99.9", "max")
    )
    lines = [
        "S5, one cycle: ratio of the median to ours at equal work and to a no-op call; us; margins and rms error in mm"
    ]
    lines += [head + "".join(f"{c:>8}" for c in ("C1", "C2", "C3", "C4", "error", "failed"))]
    for name, c in result["contenders"].items():
        t = c["time_us"]
        line = f"{name:<24}{c['ratio_to_ours']:>7.2f}{c['ratio_to_no_op']:>8.0f}"
        line += "".join(f"{t[k]:>9.1f}" for k in ("p5", "median", "mean", "cold", "p99", "p99.9", "max"))
        if "margins_mm" in c:
            line += "".join(f"{m:>8.3f}" for m in [*c["margins_mm"].values(), c["tracking_mm"]]) + f"{c['failures']:>8}"
        lines.append(line)
    lines += [
        "",
        f"{'growth':<26}{'off: median':>12}{'p99':>9}{'act: median':>14}{'p99':>9}{'active rows':>13}{'re-solves':>11}",
    ]
    for what, sizes in result["growth"].items():
        for size, by_guard in sizes.items():
            off, act = by_guard["off"], by_guard["act"]
            line = f"{what + ' ' + size:<26}{off['median']:>12.1f}{off['p99']:>9.1f}"
            line += f"{act['median']:>14.1f}{act['p99']:>9.1f}{act['active']:>13.2f}{act['resolves']:>11.3f}"
            lines.append(line)
    made = result["parts"]
    lines += ["", f"{'our step':<40}{'us':>8}{'operations':>12}{'1e9/s':>8}{'of what is possible':>21}"]
    for name, part in made["parts"].items():
        rate = part["flops"] / part["us"] * 1e-3
        line = f"{name:<40}{part['us']:>8.2f}"
        lines.append(
            line + (f"{part['flops']:>12}{rate:>8.2f}{rate * 1e9 / made['peak_flops']:>21.1%}" if rate else "")
        )
    lines.append(f"{'step, guard off, so without verification':<40}{made['step_us']:>8.2f}")
    lines += ["", *admittance_bench.lines(result["admittance"])]
    lines += ["", "in the loop: " + ", ".join(f"{k} {v}" for k, v in result["steadiness"].items())]
    return "\n".join(lines)


def write(result):
    """bench.json in the folder; returns its path."""
    folder = Path(os.environ.get(OUT, "runs/bench"))
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "bench.json"
    path.write_text(json.dumps(result, indent=1) + "\n")
    return path
