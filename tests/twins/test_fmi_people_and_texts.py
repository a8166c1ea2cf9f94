"""Bindings whose texts change, whose people and objects come and go, who reach out and crouch."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from foreshock.errors import ConfigError, TwinError
from foreshock.messages import Detections, Humans
from foreshock_twins.fmi._adult import STANDING_ADULT, placed

OSCILLATOR = Path(__file__).parent / "plants" / "oscillator"
MS = 1_000_000
HEAD = "[binding]\nstep_s = 0.001\n[[channels]]\nname = 'a/seen'\nperiod_s = 0.001\n"
SEEN = """
type = "Detections"
[[channels.detections]]
id = "{id}"
class_id = {text}
confidence = 0.9
center = ["position", 0, 1]
when = "{when}"
"""


def bound(make_twin, tmp_path, text):
    path = tmp_path / "binding.toml"
    path.write_text(HEAD + text)
    return make_twin(plant=str(OSCILLATOR), binding=str(path))


def test_a_text_follows_its_variable(make_twin, tmp_path):
    """The oscillator (2 kg, 50 N/m) moves left from x0 > 0 until it turns, half a period later: pi sqrt(m / k)."""
    text = '{ of = ["tool", "hand"], index = "moving_left" }'
    twin = bound(
        make_twin, tmp_path, SEEN.format(id="7", text=text, when="constant").replace('when = "constant"\n', "")
    )
    twin.reset({"x0": 0.5}, 0)
    classes = [s.value.detections[0].class_id for s in twin.advance(700 * MS) if isinstance(s.value, Detections)]
    assert classes[5] == "hand"
    assert "tool" in classes
    assert classes.index("tool") == pytest.approx(1000 * math.pi / math.sqrt(50.0 / 2.0), abs=3)


def test_a_text_beyond_the_list_is_the_fmus_error(make_twin, tmp_path):
    text = '{ of = ["only"], index = "moving_left" }'
    twin = bound(make_twin, tmp_path, SEEN.format(id="7", text=text, when="moving_left"))
    twin.reset({"x0": 0.5}, 0)
    with pytest.raises(TwinError, match=r"class_id must be one of 0\.\.0, the FMU gave 1\.0"):
        twin.advance(10 * MS)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('{ of = [], index = "moving_left" }', "expected a list of texts"),
        ('{ of = ["a"], index = "moving_lef" }', "did you mean 'moving_left'"),
        ('{ of = ["a"], indx = "moving_left" }', "index"),
        ('{ of = ["a"], index = "position" }', "'position' is in 'm'"),
    ],
)
def test_a_wrong_text_is_refused(make_twin, tmp_path, text, said):
    with pytest.raises(ConfigError, match="class_id") as caught:
        bound(make_twin, tmp_path, SEEN.format(id="7", text=text, when="moving_left"))
    assert said in str(caught.value)


def test_a_detection_and_a_human_are_there_while_their_flag_is(make_twin, tmp_path):
    humans = """
type = "Humans"
[[channels.humans]]
id = "human-1"
template = "standing-adult"
x = "position"
y = 0.0
when = "moving_left"
"""
    twin = bound(make_twin, tmp_path, humans)
    twin.reset({"x0": 0.5}, 0)
    seen = [len(s.value.humans) for s in twin.advance(700 * MS) if isinstance(s.value, Humans)]
    assert seen[5] == 1
    assert seen[-1] == 0
    twin = bound(make_twin, tmp_path, SEEN.format(id="7", text='"hand"', when="moving_left"))
    twin.reset({"x0": 0.5}, 0)
    seen = [len(s.value.detections) for s in twin.advance(700 * MS)]
    assert (seen[5], seen[-1]) == (1, 0)


def test_a_hand_has_three_coordinates(make_twin, tmp_path):
    text = """
type = "Humans"
[[channels.humans]]
id = "human-1"
template = "standing-adult"
x = 0.0
y = 0.0
hand_x = "position"
hand_z = 1.0
"""
    with pytest.raises(ConfigError, match=r"humans\[0\].hand_y.*all three coordinates"):
        bound(make_twin, tmp_path, text)


def test_a_stretched_arm_ends_in_the_hand_and_keeps_the_rest():
    hand = (0.6, -0.2, 1.1)
    body = placed(0.0, 0.0, 0.0, 0.0, 0.0, hand)
    changed = [k for k, (a, b) in enumerate(zip(body, STANDING_ADULT, strict=True)) if a != b]
    arm = [body[k] for k in changed]
    assert [c.region for c in arm] == ["upper-arm", "forearm", "hand"]
    assert arm[2].a == hand
    assert STANDING_ADULT[changed[0]].a[1] < 0.0, "the right arm: y points left"
    # one straight line from shoulder to hand, segment by segment
    assert arm[0].a == arm[1].b
    assert arm[1].a == arm[2].b
    shoulder = arm[0].b
    lengths = [math.dist(c.a, c.b) for c in arm]
    assert sum(lengths) == pytest.approx(math.dist(shoulder, hand))


def test_a_crouch_lowers_the_head_and_not_the_feet():
    body = placed(0.0, 0.0, 0.0, 0.0, 0.3)
    for low, high in zip(body, STANDING_ADULT, strict=True):
        if low.region in ("face", "chest", "pelvis"):
            assert high.b[2] - low.b[2] == pytest.approx(0.3)
        if low.region == "lower-leg":
            assert low == high
