"""The exhaustive check of protection levels: it covers every state, finds what it should, and finds nothing in ours."""

from __future__ import annotations

import json
import math

import pytest
from click.testing import CliRunner

from foreshock.cli.policies_cmd import policies
from foreshock.config import PolicyEntry
from foreshock.records import ProtectionLevel
from foreshock.session.ladder import PHASES, TIMES_S, Cell, KindState, _broken, check_ladder


def cells() -> dict[tuple[tuple[KindState, ...], int], Cell]:
    """One kind; the level is the phase, at most protective, and minimal risk overall once it is lost."""
    found = {}
    for phase in range(len(PHASES)):
        for lost in (False, True):
            for k, time_s in enumerate(TIMES_S):
                states = (KindState(phase, lost),)
                overall = ProtectionLevel.MINIMAL_RISK if lost else ProtectionLevel.NORMAL
                found[states, k] = Cell(states, time_s, ProtectionLevel(min(phase, 2)), overall, 1.0, ())
    return found


def test_an_ordered_ladder_has_no_broken_pair() -> None:
    assert list(_broken(cells())) == []


@pytest.mark.parametrize(
    ("spoiled", "field"),
    [(KindState(3, False), "level"), (KindState(1, True), "overall")],
)
def test_a_level_that_falls_is_found(spoiled: KindState, field: str) -> None:
    import msgspec

    grid = cells()
    key = ((spoiled,), 0)
    grid[key] = msgspec.structs.replace(grid[key], **{field: ProtectionLevel.NORMAL})
    broken = list(_broken(grid))
    assert broken
    assert all(b.worse.states == (spoiled,) and math.isinf(b.worse.time_s) for b in broken)


def test_the_protocol_of_a_mode_is_ordered_over_every_state() -> None:
    found, broken = check_ladder("A5", [PolicyEntry("protocol", {"mode": "A5"})])
    assert len(found) == 8**3 * 5
    assert broken == []
    levels = {c.level for c in found}
    assert levels == {ProtectionLevel.NORMAL, ProtectionLevel.CAUTION, ProtectionLevel.PROTECTIVE}
    assert {a for c in found for a in c.actions} == {"regrasp", "lower-load", "speed-scale"}


def test_the_command_runs_any_policy_for_the_mode_that_is_checked() -> None:
    """The ladder is for A1 by itself; checked for A5 it acts on the trust of A5."""
    done = CliRunner().invoke(policies, ["check", "A5", "--policy", "ladder", "--json"], standalone_mode=False)
    assert done.return_value == 0
    (answer,) = json.loads(done.stdout)["result"]
    assert answer["broken"] == []
    acting = {c["level"] for c in answer["table"] if "balance-lock" in c["actions"]}
    assert acting == {ProtectionLevel.PROTECTIVE}
