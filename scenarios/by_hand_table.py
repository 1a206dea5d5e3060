"""What the hand did in runs by hand, on a terminal."""

from collections.abc import Sequence
from typing import Any

from rich.console import Console

from scenarios.plain_table import plain_table


def print_hand(results: Sequence[dict[str, Any]], console: Console) -> None:
    """Print one row a run."""
    table = plain_table(
        title="the hand",
        caption=(
            "off, turned: largest error of the tip's pose, mm and deg; work: of the hand, J; rows: work of the "
            "constraints, J; excess: of passivity, J; force, torque: largest and mean of the hand, N and Nm"
        ),
    )
    table.add_column("scene", no_wrap=True)
    for column in ("off", "turned", "work", "rows", "excess", "force", "mean", "torque", "mean"):
        table.add_column(column, justify="right", no_wrap=True)
    for r in results:
        table.add_row(
            r["scene"],
            f"{r['position_error_m']['max'] * 1e3:.2f}",
            f"{r['orientation_error_rad']['max'] * 57.29577951308232:.2f}",
            f"{r['hand_work_J']:.3f}",
            f"{r['constraint_work_J']:.3f}",
            f"{r['passivity_excess_J']:.1e}",
            f"{r['max_force_N']:.1f}",
            f"{r['mean_force_N']:.1f}",
            f"{r['max_torque_Nm']:.2f}",
            f"{r['mean_torque_Nm']:.2f}",
        )
    console.print(table)
