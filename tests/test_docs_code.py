"""Every Python block of the documentation and every shell block marked `run` does what the page says."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs_page import agree, blocks

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", *sorted(p for p in (ROOT / "docs").rglob("*.md") if not {"_build", "api"} & {*p.parts})]
LANGUAGES = {"python", "sh", "yaml", "xml", "text", "toml", "bibtex"}
LONG = [p for p in PAGES if any("campaign" in b.words for b in blocks(p))]
SHORT = [p for p in PAGES if any(b.runs and "campaign" not in b.words for b in blocks(p))]


def run_page(page: Path, folder: Path, *options: str) -> int:
    """Run a page in a folder that has docs/examples and the command; returns how many blocks ran."""
    shutil.copytree(ROOT / "docs" / "examples", folder / "docs" / "examples")
    command = folder / ".venv" / "bin" / "vfi"
    command.parent.mkdir(parents=True)
    command.write_text(f'#!/bin/sh\nexec {sys.executable} -c "from scenarios.cli import main; main()" "$@"\n')
    command.chmod(0o755)
    path = os.pathsep.join([str(command.parent), str(Path(sys.executable).parent), os.environ["PATH"]])
    env = {**os.environ, "PYTHONPATH": str(ROOT), "PATH": path, "COLUMNS": "120"}
    program = [sys.executable, str(ROOT / "tests" / "docs_page.py"), str(page), *options]
    done = subprocess.run(program, cwd=folder, env=env, capture_output=True, text=True, timeout=1800)
    assert done.returncode == 0, done.stdout + done.stderr
    return int(done.stdout.splitlines()[-1])


def name(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.mark.parametrize(
    "page", [pytest.param(p, marks=pytest.mark.slow if p.name == "tutorial.md" else ()) for p in SHORT], ids=name
)
def test_code_of_a_page_runs(page, tmp_path):
    assert run_page(page, tmp_path) > 0


@pytest.mark.campaign
@pytest.mark.parametrize("page", LONG, ids=name)
def test_all_code_of_a_page_runs(page, tmp_path):
    assert run_page(page, tmp_path, "--all") > 0


def test_blocks_have_a_language_and_words_that_are_known():
    """A misspelt word would leave a block unrun."""
    for page in PAGES:
        for block in blocks(page):
            where = f"{name(page)}:{block.line}"
            assert block.language in LANGUAGES, f"{where}: {block.language}"
            rest = {w for w in block.words if not w.startswith("file=")}
            assert rest <= {"run", "alone", "output", "campaign"}, f"{where}: {rest}"


def test_readme_prints_what_it_says(tmp_path):
    (block,) = (b for b in blocks(ROOT / "README.md") if b.language == "python")
    script = tmp_path / "readme.py"
    script.write_text(block.code)
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, str(script)], env=env, capture_output=True, text=True, timeout=300)
    state, margin = done.stdout.split()
    assert state == "RUN"
    assert 0.0 < float(margin) < 0.1


def test_a_page_that_errs_is_found_out(tmp_path):
    for n, text in enumerate(
        (
            "```python\nraise ValueError\n```\n",
            "```sh run\nfalse | true\n```\n",
            "```python\nprint('margin 1.5 mm')\n```\n\n```text output\nmargin 1.6 mm\n```\n",
            "```python\nx = 1\n```\n\n```python alone\nprint(x)\n```\n",
        )
    ):
        page, folder = tmp_path / f"page{n}.md", tmp_path / str(n)
        page.write_text(text)
        folder.mkdir()
        with pytest.raises(AssertionError, match=re.escape(page.name)):
            run_page(page, folder)


def test_outputs_agree_in_words_and_within_two_percent():
    assert agree("C1: 0.880 mm, 3 cycles", "C1:   0.881 mm, 3\ncycles")
    assert not agree("C1: 0.880 mm", "C1: 0.900 mm")
    assert not agree("C1: 0.880 mm", "C2: 0.880 mm")
    assert not agree("-0.88", "0.88")
