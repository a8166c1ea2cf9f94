"""Every code block of the README and of docs/ runs: python in one namespace, sh in one folder a page, toml parses."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from sybil import Example, Sybil
from sybil.parsers.markdown import CodeBlockParser, PythonCodeBlockParser, SkipParser

from tests.docs import generated

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
KNOWN = {"python", "sh", "toml", "text", "c", "json", ""}

FILES = {
    "bind-an-fmu.md": {"[binding]": ["my-binding.toml"], 'id = "my-slip"': ["my-scenario.toml"]},
    "campaigns.md": {'id = "my-campaign"': ["my-campaign.toml"]},
    "whole-body.md": {'id = "beside-a-human"': ["beside-a-human.toml"]},
    "README.md": {"[supervisor]": ["robot.toml"]},
    "journal.md": {"[supervisor]": ["robot.toml"]},
}
"""What a page tells its reader to save, by page and first line of the block."""


def run_shell(example: Example) -> None:
    """Run a block with the environment's programs first on the path, in the page's own folder."""
    env = {**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}", "COLUMNS": "110"}
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", example.parsed],
        cwd=example.namespace["__folder__"],
        env=env,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, f"{example.parsed}\n{done.stdout}\n{done.stderr}"


def run_toml(example: Example) -> None:
    """Parse a block; where the page says to write it to a file, that file is written."""
    tomllib.loads(example.parsed)
    for name in FILES.get(Path(example.path).name, {}).get(example.parsed.split("\n", 1)[0], ()):
        (example.namespace["__folder__"] / name).write_text(example.parsed)


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_every_block_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    languages = {line.strip()[3:] for line in page.read_text().splitlines() if line.strip().startswith("```")}
    assert languages <= KNOWN, "a block in a language that nobody runs"
    shell, toml = CodeBlockParser("sh", run_shell), CodeBlockParser("toml", run_toml)
    document = Sybil([PythonCodeBlockParser(), shell, toml, SkipParser()]).parse(page)
    document.namespace["__folder__"] = tmp_path
    monkeypatch.chdir(tmp_path)
    for example in document.examples():
        example.evaluate()


def test_generated_pages_are_current() -> None:
    assert generated.stale() == [], "run: make docs"


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_links_and_pictures_exist(page: Path) -> None:
    targets = re.findall(r"\]\((?!https?:)([^)#\s]+)", page.read_text())
    assert [t for t in targets if not (page.parent / t).exists()] == []
