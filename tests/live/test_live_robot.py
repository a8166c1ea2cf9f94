"""A supervisor in a process of its own beside a robot, over real Zenoh sessions on loopback."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import msgspec
import pytest

from foreshock.link import open_link
from foreshock.messages import GripState
from foreshock.session.replay import replay
from foreshock.wire import Codec, decode_ros

sys.path.append(str(Path(__file__).parent))
from robot import Robot, free_endpoint, supervisor, until

pytest.importorskip("zenoh")


def test_lease_interventions_questions_and_an_operator(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    with supervisor(tmp_path, endpoint), Robot(endpoint) as robot:
        until(robot.guard.permitted, "the robot may move")
        status = until(lambda: (s := robot.status()) and s.motion_permitted and s, "a status that permits motion")
        assert list(status.streams) == ["robot/left_gripper/state"]
        assert "g1" in status.guards
        assert "guard/g1" in status.peers
        # a late joiner gets everything
        taxonomy = msgspec.json.decode(until(lambda: robot.ask("taxonomy"), "taxonomy"))
        assert {m["code"] for m in taxonomy["modes"]} >= {"A1", "A12"}
        config = msgspec.json.decode(until(lambda: robot.ask("config"), "configuration"))
        assert config["supervisor"]["robot"] == "robot"
        assert until(lambda: robot.ask("history"), "history")
        words = [sys.executable, "-m", "foreshock", "doctor", str(tmp_path / "run.toml"), "--json"]
        found = msgspec.json.decode(subprocess.run(words, check=True, capture_output=True).stdout)["result"]
        assert {f["what"]: f["fine"] for f in found}["robot/left_gripper/state"] is True
        # the stream ends: unobserved beyond the grace time
        robot.streaming = False
        until(lambda: robot.told("minimal-risk") == [1.0], "the minimal risk condition")
        until(lambda: not robot.guard.permitted(), "the lease ends")
        assert set(robot.stops) == {"the motion lease has expired"}
        # it comes back, but stays latched until an operator resets it, with who and why
        robot.streaming = True
        until(lambda: (s := robot.status()) and not s.health, "everything is observed again")
        assert not robot.guard.permitted()
        refused = until(lambda: robot.ask("reset", b'{"who": "", "why": "x"}'), "an answer")
        assert refused.startswith(b"error")
        words = [sys.executable, "-m", "foreshock", "reset", "robot", "--who", "jane", "--why", "gripper seen to"]
        subprocess.run([*words, "--connect", endpoint], check=True, capture_output=True)
        until(robot.guard.permitted, "the robot may move again")
        until(lambda: robot.told("minimal-risk")[-1] == 0.0, "the release is told")
        assert "announce" in {i.action for i in robot.interventions}
    (journal,) = (tmp_path / "journals").glob("*.mcap")
    result = replay(journal)
    assert result.agrees
    assert result.complete
    assert "minimal-risk" in result.levels


def test_an_operator_of_a_supervisor_that_waits_is_told(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    with supervisor(tmp_path, endpoint), Robot(endpoint, streaming=False) as robot:
        request = b'{"who": "jane", "why": "gripper seen to"}'
        refused = until(lambda: robot.ask("reset", request), "an answer")
        assert refused == b"error nothing is latched yet: waiting for robot/left_gripper/state"
        robot.streaming = True
        until(robot.guard.permitted, "the robot may move")


def test_every_kind_of_fault_is_counted_and_named_by_itself_and_stops_nothing(tmp_path: Path) -> None:
    endpoint, channel, codec = free_endpoint(), "robot/left_gripper/state", Codec()
    grip = GripState(True, 20.0, 5.0, 0.05, 20.0, 0.5, 0.0)
    with supervisor(tmp_path, endpoint), Robot(endpoint) as robot:
        until(robot.guard.permitted, "the robot may move")
        time.sleep(2.5)  # in its first 2 s a clock is believed whatever it does
        robot.streaming = False
        time.sleep(0.1)

        def counts() -> dict[str, int]:
            found = msgspec.structs.asdict(until(robot.status, "a status").streams[channel].counts)
            return {name: n for name, n in found.items() if name not in ("last_fault", "jumps", "samples")}

        def is_counted(payload: bytes, attachment: bytes | None, words: str, **more: int) -> None:
            """It adds this much to these counts and nothing to others, and health says why."""
            before = counts()
            expected = {name: n + more.pop(name, 0) for name, n in before.items()}
            assert not more
            robot.put(payload, attachment)
            until(lambda: counts() == expected, f"{words}: {expected} after {before}")
            assert f"link: {words}" in until(robot.status, "a status").health[channel]

        def now(grip: GripState = grip, after_ns: int = 0) -> tuple[bytes, int]:
            stamp_ns = time.time_ns() + after_ns
            return codec.encode(grip, stamp_ns), stamp_ns

        good, stamp_ns = now()
        robot.put(good, robot.attachment(stamp_ns))
        kind = "foreshock_msgs/msg/GripState"
        for payload, words in (
            (b"", f"{kind}: begins with nothing"),
            (b"\x00", f"{kind}: begins with 00"),
            (b"\x00\x01\x00\x00" + b"\xff" * 7, f"{kind}: cannot be decoded"),
            (good[:20], f"{kind}: cannot be decoded"),
            (b"\x00\x00" + good[2:], f"{kind}: begins with 00000000"),
            (bytes(1_200_000), f"{channel}: 1200000 bytes, at most 250000 are read"),
        ):
            is_counted(payload, robot.attachment(stamp_ns, robot.sequence + 1), words, garbage=1)
        is_counted(good, None, "attachment: missing", garbage=1)
        is_counted(good, b"short", "attachment: 5 bytes", garbage=1)
        is_counted(good, robot.attachment(stamp_ns, robot.sequence), "the number", repeated=1)
        last = robot.sequence
        later, stamp_ns = now()
        is_counted(later, robot.attachment(stamp_ns, last), f"the number {last} came twice", repeated=1)
        later, stamp_ns = now()
        words = f"the number {last - 1} came after {last}"
        is_counted(later, robot.attachment(stamp_ns, last - 1), words, disordered=1)
        older, older_ns = now(after_ns=-2_000_000_000)
        is_counted(older, robot.attachment(older_ns), "a stamp ", backwards=1)
        robot.sequence += 5
        later, stamp_ns = now()
        is_counted(later, robot.attachment(stamp_ns), "", gaps=5)
        for value in (float("nan"), float("inf"), float("-inf")):
            later, stamp_ns = now(msgspec.structs.replace(grip, normal_force=value))
            words = "a GripState with a number that is not finite"
            is_counted(later, robot.attachment(stamp_ns), words, not_finite=1)
        later, stamp_ns = now()
        robot.gid, own = b"another in a tes", robot.gid
        is_counted(later, robot.attachment(stamp_ns), "a second sender", foreign=1)
        robot.gid = own
        robot.sequence -= 1
        later, stamp_ns = now(after_ns=10_000_000_000)
        is_counted(later, robot.attachment(stamp_ns), "a stamp that its clock's offset", unbelieved=1)
        status = until(robot.status, "a status")
        until(lambda: (s := robot.status()) and s.tick > status.tick + 50, "it ticks on")


def test_who_comes_late_reads_in_a_decision_what_is_not_ok(tmp_path: Path) -> None:
    import zenoh

    endpoint, channel = free_endpoint(), "robot/left_gripper/state"
    with supervisor(tmp_path, endpoint), Robot(endpoint) as robot:
        until(robot.guard.permitted, "the robot may move")
        robot.put(b"garbage", robot.attachment(time.time_ns()))
        robot.streaming = False
        until(lambda: not robot.guard.permitted(), "nobody moves on a stream that has ended")
        status = until(lambda: (s := robot.status()) and "grip" in s.health and s, "the status says why")
        time.sleep(0.5)  # nothing changes any more
        with open_link(robot.link) as session:
            late = session.declare_subscriber(robot.keys.service("decision"), zenoh.handlers.RingChannel(1))
            raw = until(late.try_recv, "a decision")
            decision = decode_ros("foreshock_msgs/msg/Decision", raw.payload.to_bytes())
        assert "grip-micro-slip" in decision.unobserved
        said = dict(line.split(": ", 1) for line in decision.health)
        assert said.keys() == status.health.keys() == {"grip", channel}
        assert said["grip"].startswith(f"unobserved: {channel} is ")
        assert said[channel].startswith("link: foreshock_msgs/msg/GripState: begins with 67617262")


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_a_dead_or_stopped_supervisor_ends_motion_and_another_one_resumes(tmp_path: Path, how: signal.Signals) -> None:
    endpoint = free_endpoint()
    with Robot(endpoint) as robot:
        with supervisor(tmp_path, endpoint) as process:
            until(robot.guard.permitted, "the robot may move")
            os.kill(process.pid, how)
            until(lambda: robot.stops, "the guard ends motion by itself")
            assert not robot.guard.permitted()
            os.kill(process.pid, signal.SIGKILL)
        with supervisor(tmp_path, endpoint):
            until(robot.guard.permitted, "the robot may move under the next supervisor")
            until(lambda: (s := robot.status()) and s.motion_permitted, "its status says so")


def test_a_clock_that_jumps_ends_motion_until_it_is_steady_again(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    with supervisor(tmp_path, endpoint), Robot(endpoint) as robot:
        until(robot.guard.permitted, "the robot may move")
        time.sleep(2.5)  # in its first 2 s a clock is believed whatever it does
        robot.jump_ns = 10_000_000_000
        until(lambda: not robot.guard.permitted(), "nobody moves on a clock that has jumped")
        status = until(lambda: (s := robot.status()) and s.withheld and s, "the status says why")
        assert status.withheld == "the clock of robot/left_gripper/state has jumped"
        until(lambda: (s := robot.status()) and not s.withheld, "it has been steady for 2 s, and is believed again")
        status = until(robot.status, "status")
        assert status.streams["robot/left_gripper/state"].counts.jumps == 1


def test_a_clock_set_back_is_age_until_its_sender_begins_again(tmp_path: Path) -> None:
    """One end cannot tell it from a delay that came at once: old data must not become fresh by waiting."""
    endpoint, channel = free_endpoint(), "robot/left_gripper/state"
    with supervisor(tmp_path, endpoint), Robot(endpoint) as robot:
        until(robot.guard.permitted, "the robot may move")
        robot.jump_ns = -1_000_000_000
        until(lambda: not robot.guard.permitted(), "nobody moves on old samples")
        status = until(lambda: (s := robot.status()) and s.streams[channel].delay_s > 0.9 and s, "its delay is seen")
        assert "link: samples come " in status.health[channel]
        assert "later than at first" in status.health[channel]
        uptime_s = status.uptime_s
        status = until(lambda: (s := robot.status()) and s.uptime_s > uptime_s + 3.0 and s, "longer than any memory")
        assert status.streams[channel].source_age_s > 0.9
        assert not robot.guard.permitted()
        robot.streaming = False
        until(lambda: (s := robot.status()) and s.streams[channel].arrival_age_s > 1.1, "the sender has ended")
        robot.gid, robot.streaming = b"another in a tes", True
        status = until(lambda: (s := robot.status()) and s.streams[channel].delay_s < 0.1 and s, "it is met anew")
        assert "later than at first" not in status.health.get(channel, "")
        assert robot.ask("reset", b'{"who": "jane", "why": "clock seen to"}') is not None
        until(robot.guard.permitted, "the robot may move again")
