"""The folder of a comparison: comparison.json with the results, traces/ with a file a run, figures/ and report.html."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from primitives.errors import FileError
from scenarios.analysis.cells import VARIANT, Cell, gather
from scenarios.analysis.trace import Trace

RESULTS, TRACES, FIGURES, REPORT = "comparison.json", "traces", "figures", "report.html"


@dataclass(frozen=True)
class Comparison:
    """What a folder holds.

    Attributes
    ----------
    folder : where. command : that made it. results : one a run, as `vfi compare --json` prints them.
    """

    folder: Path
    command: str
    results: Sequence[Mapping[str, Any]]

    @property
    def cells(self) -> list[Cell]:
        """The runs, gathered."""
        return gather(self.results)

    def trace(self, result: Mapping[str, Any]) -> Trace:
        """The trace of a run; raises FileError."""
        return Trace.load(self.folder / trace_file(result))

    def save(self) -> None:
        """Write the results; raises FileError."""
        text = json.dumps({"command": self.command, "results": list(self.results)}, indent=2, allow_nan=False)
        try:
            (self.folder / RESULTS).write_text(f"{text}\n", encoding="utf-8")
        except OSError as error:
            raise FileError(str(self.folder / RESULTS), f"cannot be written ({error})") from None


def trace_file(result: Mapping[str, Any]) -> Path:
    """Where in the folder the trace of a run is."""
    keys = ("scene", "robot", "plant", *VARIANT[result["kind"]])
    names = [str(result[key]) for key in keys if result.get(key)]
    return Path(TRACES) / f"{'-'.join(names)}-seed{result['seed']}.mcap".replace("/", "_")


def make_folder(folder: Path) -> None:
    """Make the folder and those in it; raises FileError."""
    try:
        for name in (TRACES, FIGURES):
            (folder / name).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(str(folder), f"--out: cannot make this folder ({error})") from None


def load_comparison(folder: Path) -> Comparison:
    """Read what `vfi compare --out` left in a folder.

    Raises
    ------
    FileError : not such a folder.
    """
    file = folder / RESULTS
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise FileError(str(file), f"cannot be read ({error}); name a folder that `vfi compare --out` wrote") from None
    except ValueError as error:
        raise FileError(str(file), f"expected JSON, as `vfi compare --out` writes it ({error})") from None
    try:
        comparison = Comparison(folder, str(found["command"]), found["results"])
        if not comparison.results:
            raise ValueError("no runs")
        for cell in comparison.cells:
            trace_file(cell.runs[0])
    except (KeyError, TypeError, ValueError) as error:
        raise FileError(str(file), f"not results of `vfi compare` ({type(error).__name__}: {error})") from None
    return comparison
