"""A twin in another process, stepped over Zenoh: the same run as in process, digest for digest."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from foreshock.errors import TwinError
from foreshock.registry import Registry
from foreshock.session.isolated import Job, build_twin, run_one
from foreshock.session.scenario import find_scenario

sys.path.append(str(Path(__file__).parent))
from robot import free_endpoint

pytest.importorskip("zenoh")


def test_a_stepped_run_over_zenoh_is_the_run_in_process(tmp_path: Path) -> None:
    scenario = msgspec.structs.replace(find_scenario("a1-fall-onto-human", Registry()), duration_s=4.0)
    here = run_one(Job(scenario, "on", 5))
    assert here.interventions, "what goes to the twin matters as much as what comes from it"
    endpoint = free_endpoint()
    server = subprocess.Popen(
        [sys.executable, "-m", "foreshock", "twin", "serve", "a1-fall-onto-human", "--listen", endpoint],
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert server.stderr is not None
        assert endpoint in server.stderr.readline()
        over = msgspec.structs.replace(scenario, twin={"kind": "zenoh", "endpoint": endpoint})
        for _ in range(2):  # and again after a reset
            there = run_one(Job(over, "on", 5))
            assert there.digest == here.digest
            assert (there.outcome, there.end_s) == (here.outcome, here.end_s)
    finally:
        server.terminate()
        server.wait(20)
        if server.stderr is not None:
            server.stderr.close()


def test_a_twin_that_is_not_there_is_named(tmp_path: Path) -> None:
    registry = Registry()
    scenario = find_scenario("a1-fall-onto-human", registry)
    endpoint = free_endpoint()
    twin = {"kind": "zenoh", "endpoint": endpoint, "timeout_s": 0.5}
    with pytest.raises(TwinError, match=r"no twin at tcp/127\.0\.0\.1"):
        build_twin(msgspec.structs.replace(scenario, twin=twin), registry, tmp_path)
