"""A twin in another process, stepped over Zenoh: the same run as in process, digest for digest."""

from __future__ import annotations

import sys
from pathlib import Path

import msgspec
import pytest

from foreshock.errors import TwinError
from foreshock.registry import Registry
from foreshock.session.isolated import build_twin
from foreshock.session.scenario import find_scenario

sys.path.append(str(Path(__file__).parent))
from robot import assert_the_same_over_zenoh, free_endpoint

pytest.importorskip("zenoh")


def test_a_stepped_run_over_zenoh_is_the_run_in_process(tmp_path: Path) -> None:
    scenario = msgspec.structs.replace(find_scenario("a1-fall-onto-human", Registry()), duration_s=4.0)
    assert_the_same_over_zenoh(scenario, "a1-fall-onto-human")


def test_a_twin_that_is_not_there_is_named(tmp_path: Path) -> None:
    registry = Registry()
    scenario = find_scenario("a1-fall-onto-human", registry)
    endpoint = free_endpoint()
    twin = {"kind": "zenoh", "endpoint": endpoint, "timeout_s": 0.5}
    with pytest.raises(TwinError, match=r"no twin at tcp/127\.0\.0\.1"):
        build_twin(msgspec.structs.replace(scenario, twin=twin), registry, tmp_path)
