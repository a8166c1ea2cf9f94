"""Body regions: body.h holds ISO/TS 15066's Tables A.2 and A.3, and every plant's events and contacts go by them."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

import foreshock_fmus
from foreshock_fmus import plants

ISO = {
    "face": (65.0, 1.0, 75.0, 4.4),
    "chest": (140.0, 2.0, 25.0, 40.0),
    "abdomen": (110.0, 2.0, 10.0, 40.0),
    "pelvis": (180.0, 2.0, 25.0, 40.0),
    "upper_arm": (150.0, 2.0, 30.0, 3.0),
    "forearm": (160.0, 2.0, 40.0, 2.0),
    "hand": (140.0, 2.0, 75.0, 0.6),
    "thigh": (220.0, 2.0, 50.0, 75.0),
    "lower_leg": (130.0, 2.0, 60.0, 75.0),
}
"""Quasi-static force (N) and factor of transient contact (A.2; 1: none is permitted), N/mm and kg (A.3)."""

TRANSIENT, QUASI_STATIC, TIME_S, SHARE = "transient", "quasi-static", 0.5, 1.0
FORCES = {
    ("balance", "fall-onto-human"): ("chest", TRANSIENT),
    ("gait_swing", "leg-swing-contact"): ("lower_leg", TRANSIENT),
    ("grasp", "dropped-object"): ("lower_leg", TRANSIENT),
    ("crossing", "navigation-conflict"): ("chest", TRANSIENT),
    ("startle", "startled-into-bench"): ("pelvis", TRANSIENT),
    ("startle", "struck-by-robot"): ("chest", TRANSIENT),
    ("actuator_chain", "hand-crushed"): ("hand", QUASI_STATIC),
    ("tool_in_hand", "tool-strikes-human"): ("forearm", TRANSIENT),
    ("co_carry", "load-on-foot"): ("lower_leg", TRANSIENT),
    ("stop_restart", "hand-caught"): ("hand", TRANSIENT),
}
"""Accidents that a binding judges by a force."""

OTHERS = {
    ("arm_strike", "arm-strike"): SHARE,
    ("handover", "hand-crushed"): SHARE,
    ("perception", "press-on-forearm"): SHARE,
    ("gait_swing", "leg-held"): TIME_S,
    ("stop_restart", "hand-clamped"): TIME_S,
    ("handover", "object-dropped"): 0.5,
    ("startle", "startled-off-balance"): 0.5,
    ("tool_in_hand", "tool-cuts-human"): 1.0,
}
"""Bound of those that it judges by a share of the limit, by a time above it, or by what is no force."""


def table(path: Path) -> dict[str, Any]:
    return tomllib.loads(path.read_text())


def accidents() -> dict[tuple[str, str], dict[str, Any]]:
    found = {}
    for plant, folder in plants().items():
        for event in table(folder / "binding.toml")["events"]:
            if event["mode"]:
                found[plant, event["id"]] = event
    return found


def test_the_header_is_the_standards_table() -> None:
    text = (Path(foreshock_fmus.__file__).parent / "common" / "body.h").read_text()
    rows = re.findall(r"body_(\w+) = \{([^}]*)\}", text)
    regions = {name: tuple(float(x) for x in numbers.split(",")) for name, numbers in rows}
    assert regions == {name: (force, factor, 1e3 * k, m) for name, (force, factor, k, m) in ISO.items()}


def test_every_accident_is_known_here() -> None:
    assert set(accidents()) == FORCES.keys() | OTHERS.keys()


@pytest.mark.parametrize(("plant", "event"), FORCES)
def test_a_force_is_judged_by_the_limit_of_its_region(plant: str, event: str) -> None:
    region, contact = FORCES[plant, event]
    limit = ISO[region][0] * (ISO[region][1] if contact == TRANSIENT else 1.0)
    found = accidents()[plant, event]
    assert found["limit"] == limit
    bounds = [c["above"] for c in found["when"] if "force" in c["variable"] or "peak" in c["variable"]]
    assert bounds == [limit] or (plant, bounds) == ("balance", [1.0])  # any contact of a robot that has fallen


@pytest.mark.parametrize(("plant", "event"), OTHERS)
def test_what_is_judged_by_a_share_or_a_time_has_its_bound(plant: str, event: str) -> None:
    bound = OTHERS[plant, event]
    assert bound in [c["above"] for c in accidents()[plant, event]["when"]]


@pytest.mark.parametrize(
    ("plant", "region", "names"),
    [
        ("gait_swing", "lower_leg", {"contact_stiffness": 2, "contact_limit_quasi_static": 0}),
        ("crossing", "chest", {"contact_stiffness": 2, "human_mass": 3}),
        ("arm_strike", "chest", {"human_mass": 3}),
        ("startle", "pelvis", {"human_mass": 3}),
    ],
)
def test_parameters_that_stand_for_a_region_start_at_its_values(plant: str, region: str, names: dict[str, int]) -> None:
    start = {v["name"]: v.get("start") for v in table(plants()[plant] / f"{plant}.toml")["variables"]}
    force, factor, stiffness, mass = ISO[region]
    values = (force, factor, 1e3 * stiffness, mass)
    assert {name: start[name] for name in names} == {name: values[k] for name, k in names.items()}
