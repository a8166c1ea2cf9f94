"""ROS 2 bags of a foreign robot, MCAP and SQLite, through a supervisor; mistakes in the mapping are named."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from foreshock.cli import main
from foreshock.config import parse_config
from foreshock.errors import BadInputError
from foreshock.live import load_run
from foreshock.report.statistics import statistics_figure
from foreshock.session.bags import replay_bag

CONFIG = """
[supervisor]
robot = "talos"
period_s = 0.01
[[detectors]]
use = "actuators"
config.joints = {{ leg_left_4_joint = 300.0 }}
{topics}
"""
TOPICS = """
[topics]
"/joint_states" = "joints/state"
"/joint_commands" = "joints/command"
"""
RATED_N_M, NORMAL_N_M, LOADED_N_M = 300.0, 120.0, 299.0


def bag(path: Path, storage: StoragePlugin, seconds: float = 4.0, torn: tuple[int, ...] = (), later_s: int = 0) -> None:
    """A knee that is loaded to its limit from 2 s on, as a stranger's recorder writes it; some states end early.

    The last message may be received ``later_s`` later.
    """
    noise = np.random.default_rng(1)  # a sensor that repeats itself to the last bit is frozen
    store = get_typestore(Stores.ROS2_HUMBLE)
    joint, header, time = (
        store.types[n] for n in ("sensor_msgs/msg/JointState", "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    )
    with Writer(path, version=9, storage_plugin=storage) as writer:
        states = writer.add_connection("/joint_states", joint.__msgtype__, typestore=store)
        commands = writer.add_connection("/joint_commands", joint.__msgtype__, typestore=store)
        other = writer.add_connection("/chatter", "std_msgs/msg/String", typestore=store)
        for k in range(round(seconds * 100)):
            t_ns = 1_700_000_000_000_000_000 + k * 10_000_000
            torque = NORMAL_N_M if k < 200 else LOADED_N_M
            for connection, position in ((commands, 0.5), (states, 0.5 + noise.normal(0.0, 2e-4))):
                message = joint(
                    header=header(stamp=time(sec=t_ns // 10**9, nanosec=t_ns % 10**9), frame_id=""),
                    name=["leg_left_4_joint"],
                    position=np.array([position]),
                    velocity=np.zeros(1),
                    effort=np.array([torque]),
                )
                data = bytes(store.serialize_cdr(message, joint.__msgtype__))
                if connection is states and k in torn:
                    data = data[: len(data) // 2]
                late_ns = later_s * 10**9 if k == round(seconds * 100) - 1 else 0
                writer.write(connection, t_ns + 500_000 + late_ns, data)
            text = store.types["std_msgs/msg/String"](data="x")
            writer.write(other, t_ns, store.serialize_cdr(text, "std_msgs/msg/String"))


def run(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, dict]:
    with pytest.raises(SystemExit) as end:
        main([str(w) for w in (*words, "--json")])
    return int(end.value.code or 0), msgspec.json.decode(capsys.readouterr().out)


@pytest.mark.parametrize("storage", [StoragePlugin.MCAP, StoragePlugin.SQLITE3], ids=["mcap", "sqlite"])
def test_a_bag_runs_through_a_supervisor(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], storage: StoragePlugin
) -> None:
    bag(tmp_path / "bag", storage)
    config = tmp_path / "robot.toml"
    config.write_text(CONFIG.format(topics=TOPICS))
    report = tmp_path / "report.html"
    code, answer = run(capsys, "replay", tmp_path / "bag", "--config", config, "--report", report)
    result = answer["result"]
    assert code == 0
    assert result["samples"] == {"talos/joints/command": 400, "talos/joints/state": 400}
    assert (result["missing"], result["faults"]) == ([], {})
    assert result["unread"] == ["/chatter (std_msgs/msg/String)"]
    assert result["ticks"] == 399  # 3.99 s from the first message to the last
    # loaded from 2 s on, counted after 0.04 s of it: see ActuatorsConfig.dwell_s; a tick is 0.01 s
    assert 2.03 < result["first_s"]["torque-saturation"] < 2.07
    assert "minimal-risk" not in result["levels"]
    assert "data:image/svg+xml" in report.read_text()


def test_a_statistic_crosses_its_threshold_where_the_load_does(tmp_path: Path) -> None:
    bag(tmp_path / "bag", StoragePlugin.MCAP)
    config = parse_config(tomllib.loads(CONFIG.format(topics="")), "config")
    topics = {"/joint_states": "joints/state", "/joint_commands": "joints/command"}
    found = replay_bag(tmp_path / "bag", config, topics)
    name = "torque-saturation@leg_left_4_joint"
    t, statistic = np.array(found.series["t_s"]), np.array(found.series[f"stat:{name}"])
    seen = np.isfinite(statistic)
    assert seen.sum() > 390
    # 0.98 of the rated torque is the limit: see ActuatorsConfig.use
    assert statistic[seen & (t < 1.98)] == pytest.approx(NORMAL_N_M / RATED_N_M / 0.98)
    assert statistic[seen & (t > 2.02)] == pytest.approx(LOADED_N_M / RATED_N_M / 0.98)
    assert set(np.array(found.series[f"threshold:{name}"])[seen]) == {1.0}
    present = np.array(found.series[f"present:{name}"]) > 0.5
    assert not present[t < 2.03].any()
    assert present[t > 2.07].all()
    assert found.units == {name: "1", "actuator-drift@leg_left_4_joint": "rad"}
    figure = statistics_figure(found.series, found.units)
    drift, saturation, trust = figure.axes
    assert [p.get_ylabel() for p in (drift, saturation, trust)] == ["rad", "dimensionless", "dimensionless"]
    assert {text.get_text() for text in saturation.get_legend().get_texts()} == {"statistic", "threshold", "present"}


@pytest.mark.parametrize("storage", [StoragePlugin.MCAP, StoragePlugin.SQLITE3], ids=["mcap", "sqlite"])
def test_messages_that_cannot_be_read_are_counted_and_end_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], storage: StoragePlugin
) -> None:
    bag(tmp_path / "bag", storage, torn=(50, 51, 120))
    config = tmp_path / "robot.toml"
    config.write_text(CONFIG.format(topics=TOPICS))
    code, answer = run(capsys, "replay", tmp_path / "bag", "--config", config)
    result = answer["result"]
    assert code == 0
    assert result["samples"] == {"talos/joints/command": 400, "talos/joints/state": 397}
    assert list(result["faults"]) == ["/joint_states"]
    assert result["faults"]["/joint_states"].startswith("3 of 400 cannot be read; message 121: ")
    assert "torque-saturation" in result["first_s"]


def test_a_gap_of_years_is_refused(tmp_path: Path) -> None:
    """Two clocks in one bag: nobody wants a tick for each 10 ms of the years between."""
    bag(tmp_path / "bag", StoragePlugin.MCAP, later_s=10**8)
    config = parse_config(tomllib.loads(CONFIG.format(topics="")), "config")
    with pytest.raises(BadInputError, match=r"after 4\.0 s is 100000000 s later \(talos/joints/command\)"):
        replay_bag(tmp_path / "bag", config, {"/joint_states": "joints/state", "/joint_commands": "joints/command"})


def _file(path: Path) -> Path:
    (file,) = [f for f in path.iterdir() if f.suffix != ".yaml"]
    return file


def damaged(path: Path) -> None:
    """Lengths and pages in the middle of the bag's file are not those that were written."""
    content = _file(path).read_bytes()
    middle, end = len(content) // 2, len(content) * 3 // 4
    _file(path).write_bytes(content[:middle] + b"\xff" * (end - middle) + content[end:])


def cut(path: Path) -> None:
    content = _file(path).read_bytes()
    _file(path).write_bytes(content[: len(content) // 2])


def another(path: Path) -> None:
    _file(path).write_bytes(b"x" * 5000)


@pytest.mark.parametrize("storage", [StoragePlugin.MCAP, StoragePlugin.SQLITE3], ids=["mcap", "sqlite"])
@pytest.mark.parametrize("how", [damaged, cut, another])
def test_a_broken_bag_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], storage: StoragePlugin, how: Callable[[Path], object]
) -> None:
    bag(tmp_path / "bag", storage)
    how(tmp_path / "bag")
    config = tmp_path / "robot.toml"
    config.write_text(CONFIG.format(topics=TOPICS))
    code, answer = run(capsys, "replay", tmp_path / "bag", "--config", config)
    assert code == 2
    (error,) = answer["errors"]
    assert error["kind"] == "BadInputError"
    assert error["message"].startswith(str(tmp_path / "bag"))


def test_one_file_serves_a_bag_and_a_live_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag(tmp_path / "bag", StoragePlugin.MCAP, 0.5)
    config = tmp_path / "robot.toml"
    config.write_text(CONFIG.format(topics=TOPICS + '\n[link]\nlisten = ["tcp/127.0.0.1:7447"]'))
    assert run(capsys, "replay", tmp_path / "bag", "--config", config)[0] == 0
    loaded = load_run(config)
    assert loaded.link.listen == ("tcp/127.0.0.1:7447",)
    assert "topics" not in loaded.tables


def test_mistakes_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag(tmp_path / "bag", StoragePlugin.MCAP, 0.5)
    config = tmp_path / "robot.toml"
    config.write_text(CONFIG.format(topics='[topics]\n"/joint_state" = "joints/state"'))
    code, answer = run(capsys, "replay", tmp_path / "bag", "--config", config)
    assert code == 2
    assert "did you mean '/joint_states'" in answer["errors"][0]["message"]
    config.write_text(CONFIG.format(topics=""))
    code, answer = run(capsys, "replay", tmp_path / "bag", "--config", config)
    assert code == 2
    assert "no topic is a channel that a detector reads" in answer["errors"][0]["message"]
    code, answer = run(capsys, "replay", tmp_path / "bag")
    assert code == 2
    assert "needs --config" in answer["errors"][0]["message"]
