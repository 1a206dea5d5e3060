"""A recorded hand: a CSV file of times and wrenches."""

from pathlib import Path

from admittance.hand import ScriptedHand
from primitives.files.table_file import read_table

COLUMNS = ("t", "fx", "fy", "fz", "tx", "ty", "tz")
"""The header: seconds, N, Nm; world axes, at the handle."""


def load_hand(path: str | Path, *, interpolate: bool = True) -> ScriptedHand:
    """A hand that repeats a recorded wrench, and lets go where the record ends.

    Parameters
    ----------
    path : of a CSV file whose first line is ``t,fx,fy,fz,tx,ty,tz``; times grow from line to line.
    interpolate : straight lines between the records, else each holds until the next.

    Raises
    ------
    FileError : see `primitives.files.table_file.read_table`.
    """
    values = read_table(path, COLUMNS)
    return ScriptedHand(values[:, 0], values[:, 1:], interpolate, float(values[-1, 0]))
