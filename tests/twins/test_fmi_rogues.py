"""Plants that fail: the error says what and when, with the FMU's own words; hangs and crashes leave nothing behind."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from foreshock.errors import TwinError

ROGUE = Path(__file__).parents[1] / "rogues" / "fmus" / "rogue"
MS = 1_000_000
NONE, ERROR, DISCARD, NOT_A_NUMBER, HANG, SEGFAULT, ERROR_AT_INIT = range(7)  # rogue.c


@pytest.fixture(params=[2, 3], ids=["fmi2", "fmi3"])
def twin(request, make_twin):
    return make_twin(plant=str(ROGUE), fmi_version=request.param)


@pytest.mark.parametrize(
    ("behaviour", "kind", "detail", "log"),
    [
        (ERROR, "error", "step at t = 0.01 s gave error", "rogue: refused, 100% on purpose"),
        (DISCARD, "discard", "step at t = 0.01 s gave discard", "rogue: refused, 100% on purpose"),
        (NOT_A_NUMBER, "nan", "variable 'count' is nan at t = 0.011 s", ""),
    ],
)
def test_a_failing_step_is_a_twin_error(twin, tmp_path, behaviour, kind, detail, log):
    twin.reset({"behaviour": behaviour}, 0)
    assert len(twin.advance(10 * MS)) == 10
    with pytest.raises(TwinError) as caught:
        twin.advance(20 * MS)
    assert (caught.value.kind, caught.value.detail) == (kind, detail)
    assert log in caught.value.log
    if log:
        assert log in (tmp_path / "fmu.log").read_text()
    with pytest.raises(TwinError, match="failed"):
        twin.advance(20 * MS)
    twin.reset({}, 0)  # and it is as good as new
    assert [s.value.data for s in twin.advance(20 * MS)] == list(range(1, 21))


def test_a_failing_initialization_is_a_twin_error(twin):
    with pytest.raises(TwinError, match="initialization at t = 0 s gave error") as caught:
        twin.reset({"behaviour": ERROR_AT_INIT}, 0)
    assert "100%% refused before the first step" in caught.value.log
    with pytest.raises(TwinError, match="has not been reset"):
        twin.advance(MS)
    twin.reset({}, 0)
    assert len(twin.advance(5 * MS)) == 5


def test_each_twin_has_its_own_log(make_twin, tmp_path):
    twins = [make_twin(plant=str(ROGUE), fmi_version=2) for _ in range(2)]
    for t, behaviour in zip(twins, (NONE, ERROR), strict=True):
        t.reset({"behaviour": behaviour}, 0)
    assert len(twins[0].advance(20 * MS)) == 20
    with pytest.raises(TwinError, match="on purpose"):
        twins[1].advance(20 * MS)
    twins[0].reset({"behaviour": DISCARD}, 0)
    with pytest.raises(TwinError) as caught:
        twins[0].advance(20 * MS)
    assert caught.value.log.count("\n") == 0  # one line, its own


CHILD = textwrap.dedent("""
    import sys
    from pathlib import Path
    from foreshock_twins.fmi import FmiTwinConfig, build_twin
    plant, version, behaviour, scratch = sys.argv[1:]
    twin = build_twin(FmiTwinConfig(plant=plant, fmi_version=int(version)), "talos", Path(scratch))
    twin.reset({"behaviour": float(behaviour)}, 0)
    print("running", flush=True)
    twin.advance(20_000_000)
    print("survived", flush=True)
""")


@pytest.fixture
def child(tmp_path, fmu_cache):
    """Runs a twin in a process of its own; its scratch and its temporary directory are inside tmp_path."""
    import os

    started = []

    def start(version, behaviour):
        for name in ("scratch", "tmp"):
            (tmp_path / name).mkdir()
        command = [sys.executable, "-c", CHILD, str(ROGUE), str(version), str(behaviour), str(tmp_path / "scratch")]
        environment = {
            **os.environ,
            "FORESHOCK_CACHE": str(fmu_cache),
            "PYTHONPATH": os.pathsep.join(p for p in sys.path if p),
            "TMPDIR": str(tmp_path / "tmp"),
        }
        process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=environment, cwd=tmp_path / "tmp"
        )
        started.append(process)
        assert process.stdout.readline() == "running\n"
        return process

    yield start
    for process in started:
        if process.poll() is None:
            process.kill()
        process.communicate()


def left_after(tmp_path):
    """What lies in the temporary directory once the owner has removed the scratch directory."""
    shutil.rmtree(tmp_path / "scratch")
    return list((tmp_path / "tmp").iterdir())


@pytest.mark.parametrize("version", [2, 3])
def test_a_segmentation_fault_ends_only_the_child(child, tmp_path, version):
    process = child(version, SEGFAULT)
    out, _ = process.communicate(timeout=60)
    assert (process.returncode, out) == (-signal.SIGSEGV, "")
    assert left_after(tmp_path) == []


@pytest.mark.parametrize("version", [2, 3])
def test_a_hang_ends_with_a_kill(child, tmp_path, version):
    process = child(version, HANG)
    with pytest.raises(subprocess.TimeoutExpired):
        process.communicate(timeout=0.3)
    process.terminate()  # Python handles SIGINT between byte codes, but here are none; SIGTERM needs no handler
    out, _ = process.communicate(timeout=60)
    assert (process.returncode, out) == (-signal.SIGTERM, "")
    assert left_after(tmp_path) == []
