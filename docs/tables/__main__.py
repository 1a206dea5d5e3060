"""Prints the measured tables of the documentation: ``python -m docs.tables [NAME...]`` in the project's folder."""

import sys

from docs.tables import (
    approach,
    delay,
    drift,
    hand_feel,
    hand_fold,
    hand_matrix,
    hand_push,
    metric,
    obstacle,
    period,
    potential,
    push,
)

MODULES = (
    approach,
    drift,
    period,
    delay,
    obstacle,
    potential,
    push,
    metric,
    hand_matrix,
    hand_feel,
    hand_push,
    hand_fold,
)
TABLES = {table.NAME: table for table in MODULES}


def markdown(name: str) -> str:
    """The table as it stands in a page."""
    table = TABLES[name]
    lines = [table.HEAD, ["---"] * len(table.HEAD), *table.rows()]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


if __name__ == "__main__":
    for name in sys.argv[1:] or TABLES:
        print(f"<!-- python -m docs.tables {name} -->\n\n{markdown(name)}\n")
