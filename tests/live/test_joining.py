"""Who joins: twins that declare something else are refused by name; a robot on rmw_zenoh needs no bridge."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import msgspec
import pytest

sys.path.append(str(Path(__file__).parent))
from robot import CONFIG, Robot, free_endpoint, supervisor, until

from foreshock.link import LinkSettings, open_link
from foreshock.messages import GripState
from foreshock.wire import ChannelNote, Codec, Hello, Keys, dds_name, decode_ros, pack_attachment, rihs01

pytest.importorskip("zenoh")
GRIP = "foreshock_msgs/msg/GripState"
GOOD = Hello(
    1,
    "robot",
    10_000_000,
    False,
    "real",
    "SI",
    "REP-103",
    (ChannelNote("left_gripper/state", GRIP, rihs01(GRIP), 10_000_000),),
    (),
)
SLOW = (ChannelNote("left_gripper/state", GRIP, rihs01(GRIP), 1_000_000_000),)
OTHER = (ChannelNote("left_gripper/state", GRIP, "RIHS01_00", 10_000_000),)
IMU = "sensor_msgs/msg/Imu"
WRONG = (ChannelNote("left_gripper/state", IMU, rihs01(IMU), 10_000_000),)


def test_a_twin_that_means_something_else_is_refused_by_name(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    cases = [
        (GOOD, ""),
        (msgspec.structs.replace(GOOD, units="imperial"), "units: 'imperial', 'SI' is expected"),
        (msgspec.structs.replace(GOOD, frames="z-down"), "frames: 'z-down'"),
        (msgspec.structs.replace(GOOD, clock="simulated"), "clock: 'simulated'"),
        (msgspec.structs.replace(GOOD, channels=OTHER), "has the hash RIHS01_00"),
        (msgspec.structs.replace(GOOD, channels=SLOW), "1 samples a second, a detector needs"),
        (msgspec.structs.replace(GOOD, channels=WRONG), f"left_gripper/state: '{IMU}', '{GRIP}' is read there"),
        (msgspec.structs.replace(GOOD, robot="other-robot"), "robot: 'other-robot', 'robot' is expected"),
        (msgspec.structs.replace(GOOD, robot="other-robot", channels=SLOW), "robot: 'other-robot'"),
        (b'{"robot": "\xff"}', "'utf-8' codec can't decode"),
        (msgspec.json.encode(GOOD).replace(b"10000000}", b"9" * 400 + b"}"), "too large"),
        (msgspec.json.encode(GOOD) + b" " * 100_000, "bytes, at most 100000 are read"),
    ]
    text = CONFIG.replace('use = "grip"', 'use = "grip"\nconfig = {{ min_rate_hz = 20.0 }}')
    with supervisor(tmp_path, endpoint, text), Robot(endpoint) as robot:
        until(robot.guard.permitted, "the robot may move")
        for k, (hello, said) in enumerate(cases):
            name, answer = f"twin/{k}", hello if isinstance(hello, bytes) else msgspec.json.encode(hello)
            key = robot.keys.service(name)
            with open_link(robot.link) as session:
                queryable = session.declare_queryable(key, lambda q, key=key, answer=answer: q.reply(key, answer))
                token = session.liveliness().declare_token(robot.keys.alive("twin", str(k)))
                status = until(lambda n=name: (s := robot.status()) and n in s.peers and s, "it is seen")
                if said:
                    status = until(
                        lambda n=name: (s := robot.status()) and f"{n} is refused" in s.withheld and s, "it is refused"
                    )
                    assert said in status.withheld
                    until(lambda: not robot.guard.permitted(), "nobody moves on its numbers")
                else:
                    time.sleep(0.3)
                    until(lambda: (s := robot.status()) and not s.withheld, "nothing is held against it")
                token.undeclare()
                queryable.undeclare()
            until(robot.guard.permitted, "it has left, the robot may move")


def test_a_twin_that_has_not_answered_yet_keeps_all_from_moving(tmp_path: Path) -> None:
    import zenoh

    endpoint = free_endpoint()
    with supervisor(tmp_path, endpoint), Robot(endpoint) as robot:
        until(robot.guard.permitted, "the robot may move")
        key, questions = robot.keys.service("twin/slow"), list[Any]()
        with open_link(robot.link) as session:
            queryable = session.declare_queryable(key, questions.append)
            token = session.liveliness().declare_token(robot.keys.alive("twin", "slow"))
            status = until(lambda: (s := robot.status()) and s.withheld and s, "the supervisor waits for its answer")
            assert status.withheld == "twin/slow has not said yet what it is"
            assert not status.motion_permitted
            until(lambda: not robot.guard.permitted(), "nobody moves in the meantime")
            subscriber = session.declare_subscriber(robot.keys.service("decision"), zenoh.handlers.RingChannel(1))
            decision = until(subscriber.try_recv, "a decision").payload.to_bytes()
            health = decode_ros("foreshock_msgs/msg/Decision", decision).health
            assert health == ["lease: withheld: twin/slow has not said yet what it is"]
            while not robot.guard.permitted():  # it is asked again until it answers
                for question in [questions.pop() for _ in range(len(questions))]:
                    question.reply(key, msgspec.json.encode(GOOD))
                    question.drop()
                time.sleep(0.01)
            token.undeclare()
            queryable.undeclare()


def test_more_twins_than_are_asked_keep_all_from_moving(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    with supervisor(tmp_path, endpoint), Robot(endpoint) as robot, open_link(robot.link) as session:
        until(robot.guard.permitted, "the robot may move")
        answer = msgspec.json.encode(GOOD)
        held: list[Any] = []
        for k in range(65):
            key = robot.keys.service(f"twin/{k:02}")
            held.append(session.declare_queryable(key, lambda q, key=key: q.reply(key, answer)))
            held.append(session.liveliness().declare_token(robot.keys.alive("twin", f"{k:02}")))
        said = "twin/64 is refused: there are more than 64 twins"
        until(lambda: (s := robot.status()) and s.withheld == said, "the last one is refused")
        until(lambda: not robot.guard.permitted(), "nobody moves")


def test_more_peers_than_are_kept_keep_all_from_moving(tmp_path: Path) -> None:
    """One of them may be a twin that nobody asked."""
    endpoint = free_endpoint()
    with supervisor(tmp_path, endpoint), Robot(endpoint) as robot, open_link(robot.link) as session:
        until(robot.guard.permitted, "the robot may move")
        held = [session.liveliness().declare_token(robot.keys.alive("viewer", f"{k:03}")) for k in range(256)]
        said = "more than 256 peers are there, and what the others are is not known"
        until(lambda: (s := robot.status()) and s.withheld == said, "it is said")
        until(lambda: not robot.guard.permitted(), "nobody moves")
        assert len(held) == 256


def test_a_robot_on_rmw_zenoh_needs_no_bridge(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    text = CONFIG.replace("[live]", 'naming = "rmw_zenoh"\ndomain = 7\n\n[live]')
    with supervisor(tmp_path, endpoint, text), open_link(LinkSettings("peer", (), (endpoint,))) as ros:
        # what rmw_zenoh publishes: its key, CDR, its attachment
        key = f"7/robot/left_gripper/state/{dds_name(GRIP)}/{rihs01(GRIP)}"
        codec, grip = Codec(), GripState(True, 20.0, 5.0, 0.05, 20.0, 0.5, 0.0)
        sequence = 0

        def arrived() -> bool:
            nonlocal sequence
            for _ in range(5):
                sequence += 1
                now_ns = time.time_ns()
                ros.put(key, codec.encode(grip, now_ns), attachment=pack_attachment(sequence, now_ns, bytes(range(16))))
                time.sleep(0.01)
            for reply in ros.get(Keys("robot").service("status"), timeout=2.0):
                if reply.ok is not None:
                    status = msgspec.json.decode(reply.ok.payload.to_bytes())
                    return status["streams"]["robot/left_gripper/state"]["counts"]["samples"] > 0
            return False

        until(arrived, "its samples arrive")
        # one with another idea of the type is not read, and named
        other = key.replace("RIHS01_", "RIHS01_00")
        now_ns = time.time_ns()
        ros.put(other, codec.encode(grip, now_ns), attachment=pack_attachment(1, now_ns, b"another robot 00"))

        def named() -> bool:
            for reply in ros.get(Keys("robot").service("status"), timeout=2.0):
                if reply.ok is not None:
                    status = msgspec.json.decode(reply.ok.payload.to_bytes())
                    counts = status["streams"]["robot/left_gripper/state"]["counts"]
                    said = f"link: a sample came on {other}, {key} is read"
                    return counts["mistyped"] == 1 and said in status["health"]["robot/left_gripper/state"]
            return False

        until(named, "the other hash is counted and named")
        # what it looks for to see us: a node and a subscription in the ROS graph
        tokens = [str(r.ok.key_expr) for r in ros.liveliness().get("@ros2_lv/7/**", timeout=2.0) if r.ok is not None]
        assert any(t.endswith("/0/0/NN/%/%/foreshock") for t in tokens)
        assert any(f"/MS/%/%/foreshock/%robot%left_gripper%state/{dds_name(GRIP)}/{rihs01(GRIP)}/" in t for t in tokens)
