"""ROS 2 bags of a foreign robot, MCAP and SQLite, through a supervisor; mistakes in the mapping are named."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from foreshock.cli import main

CONFIG = """
[supervisor]
robot = "talos"
period_s = 0.01
[[detectors]]
use = "actuators"
{topics}
"""


def bag(path: Path, storage: StoragePlugin, seconds: float = 4.0) -> None:
    """A knee that is loaded beyond its limit from 2 s on, as a stranger's recorder writes it."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    joint, header, time = (
        store.types[n] for n in ("sensor_msgs/msg/JointState", "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    )
    with Writer(path, version=9, storage_plugin=storage) as writer:
        states = writer.add_connection("/joint_states", joint.__msgtype__, typestore=store)
        other = writer.add_connection("/chatter", "std_msgs/msg/String", typestore=store)
        for k in range(round(seconds * 100)):
            t_ns = 1_700_000_000_000_000_000 + k * 10_000_000
            torque = 120.0 if k < 200 else 299.0
            message = joint(
                header=header(stamp=time(sec=t_ns // 10**9, nanosec=t_ns % 10**9), frame_id=""),
                name=["leg_left_4_joint"],
                position=np.zeros(1),
                velocity=np.zeros(1),
                effort=np.array([torque]),
            )
            writer.write(states, t_ns + 500_000, store.serialize_cdr(message, joint.__msgtype__))
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
    config.write_text(CONFIG.format(topics='[topics]\n"/joint_states" = "joints/state"'))
    report = tmp_path / "report.html"
    code, answer = run(capsys, "replay", tmp_path / "bag", "--config", config, "--report", report)
    result = answer["result"]
    assert code == 0
    assert result["samples"] == {"talos/joints/state": 400}
    assert result["unread"] == ["/chatter (std_msgs/msg/String)"]
    assert result["ticks"] == 399  # 3.99 s from the first message to the last
    assert "data:image/svg+xml" in report.read_text()


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
