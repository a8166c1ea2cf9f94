"""Whatever is wrong, a user gets one message and an exit code that means it; never a traceback."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

A1 = "a1-fall-onto-human"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    (tmp_path / "markup.toml").write_text('id = "x[/y]"\n')
    return tmp_path


@pytest.mark.parametrize(
    "words",
    [
        ("simulate", A1, "--duration", "inf"),
        ("simulate", A1, "--duration", "-1"),
        ("simulate", A1, "--timeout", "-5"),
        ("simulate", A1, "--seed", "-1"),
        ("simulate", A1, "--set", "drop_mu=nan"),
        ("simulate", A1, "--set", "drop_mu=99"),
        ("simulate", A1, "--duration", "0.1", "--report", "/proc/r.html"),
        ("simulate", "binary.toml"),
        ("simulate", "markup.toml"),
        ("simulate", "."),
        ("demo", "--out", "/proc/x"),
        ("detectors", "new", "x", "--dir", "/proc/foo"),
        ("detectors", "check", "nobody"),
        ("taxonomy", "show", "--extend", "binary.toml"),
        ("taxonomy", "show", "--extend", "nowhere.toml"),
        ("config", "check", "binary.toml"),
        ("config", "check", "."),
        ("scenarios", "show", "nowhere"),
        ("falsify", A1, "--out", "f"),
        ("falsify", A1, "--out", "f", "--vary", "drop_mu=1:0"),
        ("falsify", A1, "--out", "f", "--vary", "drop_mu=0.04:0.05", "--formula", "always("),
        ("falsify", "binary.toml", "--out", "f"),
    ],
)
def test_no_traceback(words: tuple[str, ...], folder: Path) -> None:
    for as_json in ([], ["--json"]):
        done = subprocess.run(
            [sys.executable, "-c", "from foreshock.cli import main; main()", *words, *as_json],
            capture_output=True,
            text=True,
            check=False,
            timeout=120,
            cwd=folder,
        )
        assert done.returncode in (2, 3), (done.returncode, done.stdout, done.stderr)
        assert "Traceback" not in done.stderr
        assert "Traceback" not in done.stdout
        if as_json:
            answer = json.loads(done.stdout)
            assert answer["ok"] is False
            assert answer["errors"][0]["message"]
        else:
            assert done.stderr.strip().startswith("error:")
