"""Prints, at the end of a run, how far each pair of elements was from its oracles (recorded by the pairs' tests)."""

from typing import Any

COLUMNS = ("central differences", "DQ Robotics", "Pinocchio", "not finite")


def pytest_terminal_summary(terminalreporter: Any) -> None:
    found: dict[str, dict[str, str]] = {}
    for reports in terminalreporter.stats.values():
        for report in reports:
            for key, value in getattr(report, "user_properties", ()):
                if key == "pair":
                    pair, column, number = value
                    found.setdefault(pair, {})[column] = number
    if not found:
        return
    line = terminalreporter.write_line
    terminalreporter.section("pairs of elements")
    line("largest disagreement over 10 000 random and near-singular cases, and how many of 100 000 degenerate ones")
    line("gave a distance or gradient that is not finite")
    line("".join(f"{word:>22}" for word in ("", *COLUMNS)))
    for pair, numbers in sorted(found.items()):
        line(f"{pair:>22}" + "".join(f"{numbers.get(c, '-'):>22}" for c in COLUMNS))
    line("of the gradient by twists in m/m and m/rad (central differences) and of d(distance)/dq relative to its size")
    line("where that is above 1 (Pinocchio); of what DQ Robotics gives: d(d^2)/dq, for the plane dd/dq, for the angle")
    line("d(2 - 2 cos)/dq. Distances and angles from 1e-8 (Pinocchio: 1e-7) to 1; lines outside their declared band.")
