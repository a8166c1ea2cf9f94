"""Binding files: every mistake is one error with its place and the nearest right name; units and shapes are checked."""

from __future__ import annotations

import typing
from pathlib import Path

import pytest

from foreshock import messages
from foreshock.errors import BadInputError, ConfigError
from foreshock.messages import Detections, GripState, Heartbeat, Imu, Odometry, Scalar
from foreshock.policy import ACTIONS
from foreshock.taxonomy import builtin_taxonomy
from foreshock_twins.fmi._channels import MESSAGES
from foreshock_twins.fmi._message_units import MESSAGE_UNITS

OSCILLATOR = Path(__file__).parent / "plants" / "oscillator"
BINDING = (OSCILLATOR / "binding.toml").read_text()
MS = 1_000_000

MISTAKES = [
    # (old, new, place, what is said)
    ("step_s = 0.001", "step = 0.001", "binding.step_s", "is missing; did you mean 'step'"),
    ("step_s = 0.001", "step_s = 0.0", "binding.step_s", "at least 1 ns"),
    ("step_s = 0.001", "step_s = inf", "binding.step_s", "expected a finite number"),
    ('seed = "seed"', 'sead = "seed"', "binding.sead", "is not a known key; did you mean 'seed'"),
    ('seed = "seed"', 'seed = "sed"', "binding.seed", "has no variable 'sed'; did you mean 'seed'"),
    ('seed = "seed"', 'seed = "force"', "binding.seed", "expected a parameter"),
    ("[probes]", "[probe]", "probe", "is not a known key; did you mean 'probes'"),
    ('name = "joints/state"', 'name = "joints"', "channels[0].name", "expected <subject>/<quantity>"),
    ('name = "mass/plan"', 'name = "joints/state"', "channels[2].name", "given twice"),
    ('type = "JointState"', 'type = "JointStates"', "channels[0].type", "did you mean 'JointState'"),
    ("period_s = 0.005", "period_s = 0.0055", "channels[1].period_s", "expected a multiple of the step"),
    ("period_s = 0.005", "period_s = 0.0", "channels[1].period_s", "expected a multiple of the step"),
    ("period_s = 0.005", "perod_s = 0.005", "channels[1].period_s", "is missing; did you mean 'perod_s'"),
    ('stamp = "sampled"', 'stamp = "sample"', "channels[1].stamp", "did you mean 'sampled'"),
    ('stamp = "sampled"', 'stamp = "position"', "channels[1].stamp", "'position' is in 'm'; a source time is in 's'"),
    ('stamp = "sampled"', "stamp = 3.0", "channels[1].stamp", "expected a string"),
    ('force = "spring[1..3]"', 'forse = "spring[1..3]"', "channels[1].fields.forse", "did you mean 'force'"),
    ('force = "spring[1..3]"\n', "", "channels[1].fields.force", "is missing; WrenchStamped needs it"),
    (
        'force = "spring[1..3]"',
        'force = "spring[1..2]"',
        "channels[1].fields.force",
        "2 components; WrenchStamped.force needs 3",
    ),
    (
        'force = "spring[1..3]"',
        'force = "spring[1..4]"',
        "channels[1].fields.force",
        "no variable 'spring[4]'; did you mean",
    ),
    ('force = "spring[1..3]"', 'force = "spring[3..1]"', "channels[1].fields.force", "empty range"),
    ('force = "spring[1..3]"', 'force = "sprung[1..3]"', "channels[1].fields.force", "did you mean 'spring[1]'"),
    (
        'force = "spring[1..3]"',
        'force = "torque[1..3]"',
        "channels[1].fields.force",
        "is in 'N.m'; WrenchStamped.force is in 'N'",
    ),
    (
        'force = "spring[1..3]"',
        'force = ["force", 0, 0]',
        "channels[1].fields.force",
        "'force' is an input; expected an output",
    ),
    ('force = "spring[1..3]"', "force = [nan, 0, 0]", "channels[1].fields.force", "expected a finite number"),
    ('force = "spring[1..3]"', "force = [[0], 0, 0]", "channels[1].fields.force", "expected a finite number"),
    ('frame_id = "mass"', "frame_id = 3", "channels[1].fields.frame_id", "expected a string"),
    ('position = "joint.angle[1..2]"', 'position = "joint.angle[1]"', "channels[0].fields.position", "2 joint names"),
    (
        'position = "joint.angle[1..2]"',
        'position = ["position", "velocity"]',
        "channels[0].fields.position",
        "'rad or m'",
    ),
    ('name = ["drum", "counter"]', 'name = ["drum"]', "channels[0].fields.position", "1 joint names"),
    ('name = ["drum", "counter"]', "name = 3", "channels[0].fields.name", "expected a list of names"),
    ('name = ["drum", "counter"]', 'name = {drum = "moving_left"}', "channels[0].fields.name", "cannot change"),
    ('left = "moving_left"', 'left = "moving_lift"', "channels[2].fields.support.left", "did you mean 'moving_left'"),
    (
        'left = "moving_left"',
        'left = "velocity"',
        "channels[2].fields.support.left",
        "is in 'm/s'; MotionPlan.support is in '1'",
    ),
    ('speed = "velocity"', 'speed = "spring[1..3]"', "channels[2].fields.speed", "is one number"),
    ('speed = "velocity"', "speed = true", "channels[2].fields.speed", "expected a finite number"),
    ('template = "standing-adult"', 'template = "standing-adlt"', "channels[3].humans[0].template", "'standing-adult'"),
    ("y = 1.2\n", "", "channels[3].humans[0].y", "is missing"),
    ("vy = 0.0\n", "", "channels[3].humans[0].vy", "both components"),
    ("yaw = 3.0", 'yaw = "position"', "channels[3].humans[0].yaw", "is in 'm'; a human's yaw is in 'rad'"),
    ("yaw = 3.0", "jaw = 3.0", "channels[3].humans[0].jaw", "did you mean 'yaw'"),
    ('action = "push"', 'action = "pull"', "interventions[1].action", "given twice"),
    (
        'action = "push"',
        'action = "balance-lok"',
        "interventions[0].action",
        "'balance-lok' is not a known action; did you mean 'balance-lock'?",
    ),
    ('action = "push"', 'action = "Balance_Lock"', "interventions[0].action", "did you mean 'balance-lock'?"),
    ('action = "push"', 'action = "minimal-risks"', "interventions[0].action", "did you mean 'minimal-risk'?"),
    ('action = "push"', 'action = "push it"', "interventions[0].action", "expected one in kebab-case"),
    ('action = "push"', 'action = ""', "interventions[0].action", "expected one in kebab-case"),
    ("force = 100.0", "forse = 100.0", "interventions[0].inputs.forse", "did you mean 'force'"),
    (
        "force = 100.0",
        "position = 100.0",
        "interventions[0].inputs.position",
        "causality output, but an intervention sets an input",
    ),
    ("force = 100.0", "force = 1001.0", "interventions[0].inputs.force", "range is [-1000.0, 1000.0]"),
    ("{ force = 100.0 }", "{}", "interventions[0].inputs", "is empty"),
    ('value = "moving_left"', 'value = "moving_loft"', "events[0].value", "did you mean 'moving_left'"),
    ('value = "moving_left"', 'value = "force"', "events[0].value", "is an input"),
    ('mode = "A1"', 'mode = "A77"', "events[0].mode", "'A77' is not the code of an accident mode; did you mean 'A7'"),
    ('mode = "A1"', 'mode = "a1"', "events[0].mode", "'a1' is not the code of an accident mode"),
    ("below = 0.0", "beneath = 0.0", "events[0].when[0].above", "give one of above and below"),
    ("below = 0.0", "below = 0.0, above = 1.0", "events[0].when[0].above", "give one of above and below"),
    ("limit = 0.5\n", "", "events[0].limit", "is missing"),
    ('unit = "1"', 'unit = "N"', "events[0].unit", "variable 'moving_left' is in '1'"),
    ('x = "position"\nv', 'x = "positon"\nv', "probes.x", "did you mean 'position'"),
]


@pytest.mark.parametrize(("old", "new", "place", "said"), MISTAKES)
def test_a_wrong_binding_is_refused_with_its_place(make_twin, tmp_path, old, new, place, said):
    assert old in BINDING
    path = tmp_path / "wrong.toml"
    path.write_text(BINDING.replace(old, new, 1))
    with pytest.raises(ConfigError) as caught:
        make_twin(plant=str(OSCILLATOR), binding=str(path))
    assert caught.value.place in (f"{path}: {place}",)
    assert said in str(caught.value)


@pytest.mark.parametrize("action", [*sorted(ACTIONS), "wave-arms", "sit"])
def test_known_actions_and_those_of_a_policy_plugin_are_bound(make_twin, tmp_path, action):
    path = tmp_path / "binding.toml"
    path.write_text(BINDING.replace('action = "push"', f'action = "{action}"'))
    assert make_twin(plant=str(OSCILLATOR), binding=str(path)).actions == {action, "pull"}


@pytest.mark.parametrize("mode", ["", *builtin_taxonomy().codes])
def test_an_event_has_a_mode_of_the_taxonomy_or_none(make_twin, tmp_path, mode):
    path = tmp_path / "binding.toml"
    path.write_text(BINDING.replace('mode = "A1"', f'mode = "{mode}"'))
    make_twin(plant=str(OSCILLATOR), binding=str(path))


@pytest.mark.parametrize(
    ("config", "said"),
    [
        ({}, "give one of plant and fmu"),
        ({"plant": "balance", "fmu": "x.fmu"}, "give one of plant and fmu"),
        ({"plant": "no-such-plant-at-all"}, "there is no plant"),
        ({"fmu": "nowhere.fmu"}, "there is no file 'nowhere.fmu'"),
        ({"fmu": __file__}, "needs a binding file"),
        ({"fmu": __file__, "binding": "b.toml"}, "is no FMU"),
        ({"plant": str(OSCILLATOR), "binding": str(OSCILLATOR / "bindin.toml")}, "did you mean 'binding.toml'"),
        ({"plant": str(OSCILLATOR), "fmi_version": 1}, "expected 2 or 3"),
    ],
)
def test_a_wrong_configuration_is_refused(make_twin, config, said):
    with pytest.raises(BadInputError) as caught:
        make_twin(**config)
    assert said in str(caught.value)


def numeric_fields(cls):
    """Fields of a message that hold numbers or flags, from its annotations alone."""
    for name, hint in typing.get_type_hints(cls).items():
        arguments = [a for a in typing.get_args(hint) if a is not Ellipsis] or [hint]
        if name == "support" or all(a in (float, int, bool) for a in arguments):
            yield name


def test_every_numeric_field_of_every_message_has_a_unit():
    classes = [*MESSAGES.values(), messages.Detection]
    assert {(c.__name__, f) for c in classes for f in numeric_fields(c)} == set(MESSAGE_UNITS)


ALL_MESSAGES = """
[binding]
step_s = 0.001
[[channels]]
name = "a/scalar"
type = "Scalar"
period_s = 0.001
fields = { data = "velocity" }
[[channels]]
name = "a/imu"
type = "Imu"
period_s = 0.001
fields = { orientation = [0, 0, 0, 1], angular_velocity = [0, 0, 0.5], linear_acceleration = [0, 0, 9.81] }
[[channels]]
name = "a/odometry"
type = "Odometry"
period_s = 0.001
fields = { position = ["position", 0, 1], orientation = [0, 0, 0, 1], linear = ["velocity", 0, 0], angular = [0, 0, 0] }
[[channels]]
name = "a/grip"
type = "GripState"
period_s = 0.001
[channels.fields]
grasping = "moving_left"
normal_force = "spring[1]"
tangential_force = 0
opening = "position"
commanded_force = 12
[[channels]]
name = "a/heartbeat"
type = "Heartbeat"
period_s = 0.001
fields = { sequence = "moving_left", round_trip_s = "sampled" }
[[channels]]
name = "a/detections"
type = "Detections"
period_s = 0.001
fields = { frame_id = "map" }
detections = [{ id = "7", class_id = "person", confidence = 0.9, center = ["position", 0, 1] }]
[[channels]]
name = "a/humans"
type = "Humans"
period_s = 0.001
[[channels]]
name = "a/wrench"
type = "WrenchStamped"
period_s = 0.001
fields = { force = "spring[1..3]", torque = [0, 0, 0] }
"""


def test_every_message_type_can_be_bound(make_twin, tmp_path):
    path = tmp_path / "all.toml"
    path.write_text(ALL_MESSAGES)
    twin = make_twin(plant=str(OSCILLATOR), binding=str(path))
    twin.reset({"x0": 0.5}, 0)
    values = {s.channel.split("/")[-1]: s.value for s in twin.advance(MS)}
    assert all(messages.is_finite(v) for v in values.values())
    x = values["odometry"].position[0]
    v = values["scalar"].data
    assert x == pytest.approx(0.5, abs=1e-5)  # a0 t^2 / 2 = 6.25e-6
    assert v == pytest.approx(-12.5e-3, rel=1e-2)  # -k x0 / m * t
    assert values["imu"] == Imu((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.5), (0.0, 0.0, 9.81))
    assert values["odometry"] == Odometry((x, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0), (v, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert values["grip"] == GripState(True, -50.0 * x, 0.0, x, 12.0)
    assert values["grip"].grasping is True
    assert values["heartbeat"] == Heartbeat(1, 0.0)
    assert type(values["heartbeat"].sequence) is int
    assert values["detections"] == Detections((messages.Detection("7", "person", 0.9, (x, 0.0, 1.0)),), frame_id="map")
    assert values["humans"] == messages.Humans(())
    assert isinstance(values["scalar"], Scalar)


def test_an_integer_field_refuses_a_fraction(make_twin, tmp_path):
    from foreshock.errors import TwinError

    path = tmp_path / "fraction.toml"
    path.write_text(
        '[binding]\nstep_s = 0.001\n[[channels]]\nname = "a/beat"\ntype = "Heartbeat"\nperiod_s = 0.001\n'
        "fields = { sequence = 1.5 }\n"
    )
    twin = make_twin(plant=str(OSCILLATOR), binding=str(path))
    twin.reset({}, 0)
    with pytest.raises(TwinError, match=r"Heartbeat.sequence must be an integer, the FMU gave 1.5"):
        twin.advance(MS)
