"""The code blocks of a page of the documentation, and how to run them: ``python tests/docs_page.py PAGE [--all]``.

The words behind a block's language say what is done with it, in order and in one folder:

    python          is run; the blocks of a page share their names
    python alone    is run with names of its own
    sh run          is run by bash; `vfi` is the command of this checkout
    yaml file=NAME  (or another language) is written to the file NAME
    text output     is what the block before it has printed; numbers may differ by 2 %
    ... campaign    only with --all
"""

import contextlib
import io
import math
import re
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

FENCE = re.compile(r"^```(?P<info>[a-z][^\n`]*)\n(?P<code>.*?)^```$", re.S | re.M)
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?!\w)")
TOLERANCE = 0.02


class Block(NamedTuple):
    """A fenced block: where its first line stands, its language, the words behind it, and what is in it."""

    line: int
    language: str
    words: tuple[str, ...]
    code: str

    @property
    def file(self) -> str:
        """The file that it is written to, empty for none."""
        return next((word.removeprefix("file=") for word in self.words if word.startswith("file=")), "")

    @property
    def runs(self) -> bool:
        return self.language == "python" or "run" in self.words


def blocks(page: Path) -> list[Block]:
    text = page.read_text(encoding="utf-8")
    return [
        Block(text.count("\n", 0, m.start()) + 2, m["info"].split()[0], tuple(m["info"].split()[1:]), m["code"])
        for m in FENCE.finditer(text)
    ]


def agree(printed: str, shown: str) -> bool:
    """Whether two texts have the same words and, within the tolerance, the same numbers."""
    words = [NUMBER.sub("#", text).split() for text in (printed, shown)]
    numbers = [[float(n) for n in NUMBER.findall(text)] for text in (printed, shown)]
    same = words[0] == words[1] and len(numbers[0]) == len(numbers[1])
    return same and all(
        math.isclose(a, b, rel_tol=TOLERANCE, abs_tol=1e-12) for a, b in zip(numbers[0], numbers[1], strict=True)
    )


def run(page: Path, everything: bool) -> int:
    """Run the blocks of a page in the present folder; returns how many were run."""
    names: dict[str, Any] = {"__name__": "__main__"}
    printed, count = "", 0
    for block in blocks(page):
        if "campaign" in block.words and not everything:
            continue
        where = f"{page.name}:{block.line}"
        if block.file:
            Path(block.file).write_text(block.code, encoding="utf-8")
        elif block.language == "text" and "output" in block.words:
            if not agree(printed, block.code):
                raise SystemExit(f"{where}: the page shows\n{block.code}\nand printed was\n{printed}")
        elif block.language == "python":
            out = io.StringIO()
            with contextlib.redirect_stdout(out):
                code = compile(block.code, where, "exec")
                exec(code, {"__name__": "__main__"} if "alone" in block.words else names)
            printed, count = out.getvalue(), count + 1
        elif block.runs:
            done = subprocess.run(["bash", "-euo", "pipefail", "-c", block.code], capture_output=True, text=True)
            if done.returncode:
                raise SystemExit(f"{where}: exit code {done.returncode}\n{done.stdout}\n{done.stderr}")
            printed, count = done.stdout, count + 1
    return count


if __name__ == "__main__":
    print(run(Path(sys.argv[1]), "--all" in sys.argv))
