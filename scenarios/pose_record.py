"""`PoseRecord`: a reference that was recorded, as a CSV file of poses over time."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from primitives import dual_quaternion as dq
from primitives.checks import Array, number
from primitives.errors import FileError, InputError
from primitives.files.table_file import read_table
from scenarios.trajectory import Station

COLUMNS = ("t", "x", "y", "z", "qw", "qx", "qy", "qz")
"""The header: seconds; metres, world; a unit quaternion, scalar first."""
MOST_STATIONS = 12
NO_UNIT = 1e-3
"""How far from 1 the norm of a recorded quaternion may be; what is nearer is rounding, and is normalised."""


@dataclass(frozen=True)
class PoseRecord:
    """Recorded poses joined by ScLERP, the short way; the first one is held before its time, the last one after it.

    Attributes
    ----------
    file : a CSV file whose first line is ``t,x,y,z,qw,qx,qy,qz``; times grow from line to line, and the scene begins at
        t = 0.

    Raises
    ------
    InputError : no name of a file.
    """

    file: str

    def __post_init__(self) -> None:
        if not isinstance(self.file, str) or not self.file:
            raise InputError(f"PoseRecord: expected the name of a CSV file, got {self.file!r:.80}")

    def read(self) -> tuple[Array, Array]:
        """(k,) times in seconds and (k, 8) unit dual quaternions.

        Raises
        ------
        FileError : see `primitives.files.table_file.read_table`; or a quaternion that is no unit quaternion.
        """
        values = read_table(self.file, COLUMNS)
        norms = np.linalg.norm(values[:, 4:], axis=1)
        wrong = np.flatnonzero(np.abs(norms - 1.0) > NO_UNIT)
        if len(wrong):
            t, norm = values[wrong[0], 0], norms[wrong[0]]
            raise FileError(self.file, f"at t = {t:g} s: expected a unit quaternion qw,qx,qy,qz, got norm {norm:.6g}")
        turns = values[:, 4:] / norms[:, None]
        pairs = zip(turns, values[:, 1:4], strict=True)
        return values[:, 0], np.array([dq.from_rotation_translation(r.copy(), p.copy()) for r, p in pairs])

    def check(self) -> None:
        """Read the file once, so that what is wrong with it is told before anything runs."""
        self.read()

    def stations(self, first_orientation: ArrayLike) -> list[Station]:
        """At most `MOST_STATIONS` of the records, evenly chosen with both ends; errors as for `read`."""
        times, poses = self.read()
        chosen = np.unique(np.linspace(0, len(times) - 1, min(len(times), MOST_STATIONS)).round().astype(int))
        return [Station(f"record at {times[i]:g} s", float(times[i]), poses[i]) for i in chosen]

    def sample(self, first_orientation: ArrayLike, period: float, cycles: int) -> Array:
        """(cycles, 8) the reference at t = 0, T, 2 T, ... for a period T in seconds; errors as for `read`.

        first_orientation is not needed: what was recorded says how the tool was turned.
        """
        number(period, "period of the reference, seconds", positive=True)
        times, poses = self.read()
        out = np.empty((cycles, 8))
        for k in range(cycles):
            i = int(np.searchsorted(times, k * period, side="right")) - 1
            if i < 0 or i + 1 == len(times):
                out[k] = poses[max(i, 0)]
            else:
                share = (k * period - times[i]) / (times[i + 1] - times[i])
                out[k] = dq.sclerp(poses[i], poses[i + 1], share)
            if k:
                out[k] = dq.nearest_sign(out[k], out[k - 1])
        return out

    def located(self, folder: Path) -> "PoseRecord":
        """The record with the whole path of its file, from a folder where it does not say from where."""
        return PoseRecord(str((folder / self.file).absolute()))
