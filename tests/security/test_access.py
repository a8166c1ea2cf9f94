"""Without the right certificate nothing can be published that the supervisor or the guard acts on."""

from __future__ import annotations

import itertools
import sys
import time
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import pytest
import tomli_w

sys.path.append(str(Path(__file__).parents[1] / "live"))
from robot import free_endpoint, supervisor, until

from foreshock.errors import BadInputError
from foreshock.guard import Guard
from foreshock.guard._cdr import Numbered, Request, pack_intervention, pack_lease, pack_request
from foreshock.link import LinkSettings, TlsSettings, open_link, ros_tokens
from foreshock.live import Status, init_security
from foreshock.messages import GripState
from foreshock.records import Intervention, Lease
from foreshock.wire import Codec, Keys, Naming, pack_attachment

pytest.importorskip("zenoh")
KEYS = Keys("robot")
CONFIG = """
[supervisor]
robot = "robot"
period_s = 0.01
[[detectors]]
use = "grip"
[live]
ttl_s = 0.3
"""


class Plant:
    """A supervisor with access rules, and how others reach it."""

    def __init__(self, folder: Path, endpoint: str) -> None:
        self.folder, self.endpoint = folder, endpoint

    def link(self, name: str, ca: str = "ca.pem", folder: Path | None = None) -> LinkSettings:
        at = folder or self.folder
        tls = TlsSettings(str(at / ca), str(at / f"{name}.pem"), str(at / f"{name}.key.pem"))
        return LinkSettings("client", (), (self.endpoint,), tls=tls)

    def open(self, name: str) -> Any:
        return until(lambda: _opened(self.link(name)), f"{name} joins")

    def status(self, session: Any) -> Status | None:
        for reply in session.get(KEYS.service("status"), timeout=3.0):
            if reply.ok is not None:
                return msgspec.json.decode(reply.ok.payload.to_bytes(), type=Status)
        return None


def _opened(link: LinkSettings) -> Any:
    try:
        return open_link(link)
    except BadInputError:
        return None


@contextmanager
def a_plant(folder: Path, naming: Naming = "foreshock", domain: int = 0) -> Iterator[Plant]:
    """A supervisor with the rules that ``security init`` writes, but for a peer ``stranger``, whom none names."""
    init_security(
        folder, "robot", {"scene": ["humans/pose"], "stranger": ["humans/pose"]}, naming=naming, domain=domain
    )
    endpoint = free_endpoint().replace("tcp/", "tls/")
    link = tomllib.loads((folder / "link.toml").read_text())["link"]
    link |= {"listen": [endpoint], "access": [r for r in link["access"] if r["name"] != "stranger"]}
    text = tomli_w.dumps({"link": link}).replace("{", "{{").replace("}", "}}")
    with supervisor(folder, endpoint, CONFIG + text):
        yield Plant(folder, endpoint)


@pytest.fixture(scope="module")
def plant(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Plant]:
    with a_plant(tmp_path_factory.mktemp("certificates") / "here") as plant:
        yield plant


def stream(session: Any, k: int, keys: Keys = KEYS) -> None:
    """One sample of the gripper."""
    stamp_ns = time.time_ns()
    payload = Codec().encode(GripState(True, 20.0 + 1e-3 * (k % 7), 5.0, 0.05, 20.0, 0.5, 0.0), stamp_ns)
    key = keys.stream("robot/left_gripper/state", "foreshock_msgs/msg/GripState")
    session.put(key, payload, attachment=pack_attachment(k, stamp_ns, b"0123456789abcdef"))


def samples(plant: Plant, session: Any) -> int:
    status = until(lambda: plant.status(session), "a status")
    return int(status.streams["robot/left_gripper/state"].counts.samples)


def test_only_the_robot_writes_its_streams(plant: Plant) -> None:
    with plant.open("viewer") as viewer, plant.open("scene") as scene, plant.open("robot") as robot:
        until(lambda: plant.status(viewer), "a viewer may ask")
        before = samples(plant, viewer)
        for k in range(20):
            stream(scene, k)  # a twin, whose channel this is not
            stream(viewer, k)
        time.sleep(0.3)
        assert samples(plant, viewer) == before
        for k in range(20):
            stream(robot, 1000 + k)
        until(lambda: samples(plant, viewer) > before, "the robot's samples arrive")


def denied(plant: Plant, name: str, what: str, key: str) -> int:
    """How often the status says that a peer of this name tried this."""
    with plant.open("viewer") as viewer:
        status = until(lambda: plant.status(viewer), "a status")
    return sum(d.count for d in status.denied if (d.name, d.what, d.key) == (name, what, key))


def refused(plant: Plant, reason: str) -> int:
    with plant.open("viewer") as viewer:
        status = until(lambda: plant.status(viewer), "a status")
    return sum(r.count for r in status.refused if reason in r.reason)


def test_a_twin_that_writes_interventions_is_shown(plant: Plant) -> None:
    key = KEYS.service("intervention")
    before = denied(plant, "scene", "Put", key)
    with plant.open("scene") as scene:
        scene.put(key, b"go")
        until(lambda: denied(plant, "scene", "Put", key) > before, "it is shown by name")
        before = denied(plant, "scene", "Put", key)
        with scene.declare_publisher(key) as publisher:  # whose key Zenoh has judged once for all
            publisher.put(b"go")
            until(lambda: denied(plant, "scene", "Put", key) > before, "each try counts")
        for what in ("Query", "Delete", "Declare Queryable"):
            assert denied(plant, "scene", what, key) == 0, "what it did not try is not held against it"


def test_a_question_that_only_an_operator_may_ask_is_shown(plant: Plant) -> None:
    key = KEYS.service("reset")
    before = denied(plant, "viewer", "Query", key)
    with plant.open("viewer") as viewer:
        list(viewer.get(key, payload=b"{}", timeout=1.0))
    until(lambda: denied(plant, "viewer", "Query", key) == before + 1, "it is shown")


def test_a_second_supervisor_is_shown_and_tells_nobody_anything(plant: Plant) -> None:
    with plant.open("viewer") as viewer, plant.open("robot") as robot:
        heard = [robot.declare_subscriber(KEYS.service(s)) for s in ("lease", "intervention", "decision")]
        time.sleep(0.3)
        with plant.open("supervisor") as second:  # its certificate is the supervisor's own, stolen or from a twin plant
            for service in ("lease", "intervention", "decision"):
                second.put(KEYS.service(service), b"second supervisor")
            token = second.liveliness().declare_token(KEYS.alive("supervisor", "9"))
            for service in ("lease", "intervention", "decision"):
                until(lambda s=service: denied(plant, "supervisor", "Put", KEYS.service(s)), f"its {service}")
            until(lambda: denied(plant, "supervisor", "Liveliness Token", KEYS.alive("supervisor", "9")), "its token")
            assert "supervisor/9" not in until(lambda: plant.status(viewer), "a status").peers
            token.undeclare()
            list(second.get(KEYS.service("reset"), payload=b"{}", timeout=1.0))
            until(lambda: denied(plant, "supervisor", "Query", KEYS.service("reset")), "its question")
            assert plant.status(second) is not None, "as foreshock doctor does"
        for subscriber in heard:
            while (sample := subscriber.try_recv()) is not None:
                assert sample.payload.to_bytes() != b"second supervisor"


def test_who_is_named_by_no_rule_is_shown_and_writes_nothing(plant: Plant) -> None:
    with plant.open("viewer") as viewer, plant.open("stranger") as stranger:
        before = samples(plant, viewer)
        stream(stranger, 0)
        until(lambda: denied(plant, "stranger", "anything", ""), "no rule names it")
        assert samples(plant, viewer) == before
        assert plant.status(stranger) is None


def test_with_the_naming_of_rmw_zenoh_a_robot_streams_and_nobody_in_its_place(tmp_path: Path) -> None:
    keys = Keys("robot", "rmw_zenoh", 7)
    with (
        a_plant(tmp_path / "here", keys.naming, keys.domain) as plant,
        plant.open("viewer") as viewer,
        plant.open("scene") as scene,
        plant.open("robot") as robot,
    ):
        before = samples(plant, viewer)
        for k in range(20):
            stream(scene, k, keys)
            stream(viewer, k, keys)
            stream(robot, k, Keys("robot", "rmw_zenoh", 8))  # another domain is another plant's
        key = keys.stream("robot/left_gripper/state", "foreshock_msgs/msg/GripState")
        for name in ("scene", "viewer"):
            until(lambda n=name: denied(plant, n, "Put", key), f"{name} is shown")
        assert samples(plant, viewer) == before
        numbers = itertools.count(100)
        until(lambda: stream(robot, next(numbers), keys) or samples(plant, viewer) > before, "they arrive")
        # its own channel a twin may write, and the robot's node and topics are announced to ROS 2
        pose = keys.stream("robot/humans/pose", "foreshock_msgs/msg/Humans")
        with viewer.declare_subscriber(pose) as heard:
            until(lambda: scene.put(pose, b"x") or heard.try_recv(), "the twin's stream arrives")
        tokens = ros_tokens(robot, keys, "MP", {"robot/left_gripper/state": "foreshock_msgs/msg/GripState"})
        zid = str(robot.zid())

        def announced() -> int:
            found = viewer.liveliness().get(f"@ros2_lv/7/{zid}/**", timeout=1.0)
            return sum(r.ok is not None for r in found)

        until(lambda: announced() == len(tokens) == 2, "the tokens arrive")


def test_no_wildcard_reaches_a_service(plant: Plant) -> None:
    """The robot may write each of its channels, hence all at once: its guard must not hear that as an intervention."""
    told: list[Intervention] = []
    guard = Guard("robot", lambda i: told.append(i) is None, lambda _: None, plant.link("robot"), "g2")
    forged = pack_intervention(Numbered(2**62, 1, Intervention(0, "forged", 1.0)))
    with plant.open("robot") as robot, plant.open("viewer") as viewer, guard:
        until(lambda: "guard/g2" in until(lambda: plant.status(viewer), "a status").peers, "the guard is there")
        for key in ("*/intervention", "*/*", "**", "$*i/intervention", "@$*/intervention"):
            robot.put(f"foreshock/robot/{key}", forged)
        time.sleep(0.5)
        assert "forged" not in {i.action for i in told}
        assert guard.counts.fenced == 0


def test_nobody_else_answers_for_the_supervisor(plant: Plant) -> None:
    with plant.open("viewer") as viewer, plant.open("scene") as scene, plant.open("robot") as robot:
        for liar in (scene, robot):
            for service in ("status", "reset", "config"):
                key = KEYS.service(service)
                liar.declare_queryable(key, lambda q, key=key: q.reply(key, b'{"all": "well"}'), complete=True)
        time.sleep(0.3)
        for _ in range(5):
            for reply in viewer.get(KEYS.service("status"), target=target_all(), timeout=3.0):
                assert b"well" not in reply.ok.payload.to_bytes()
        until(lambda: denied(plant, "scene", "Declare Queryable", KEYS.service("status")), "it is shown")


def target_all() -> Any:
    import zenoh

    return zenoh.QueryTarget.ALL


def test_nobody_but_the_supervisor_tells_a_guard_anything(plant: Plant) -> None:
    told: list[Intervention] = []
    guard = Guard("robot", lambda i: told.append(i) is None, lambda _: None, plant.link("robot"), "g1")
    with plant.open("scene") as scene, plant.open("robot") as robot, plant.open("operator") as operator, guard:
        time.sleep(0.3)
        forged = pack_intervention(Numbered(2**62, 1, Intervention(0, "forged", 1.0)))
        for session in (scene, robot, operator):
            session.put(KEYS.service("intervention"), forged)
            # the guard's next requests are 1, 2, 3, ...: a lease that would match one of them by luck
            for nonce in range(200):
                session.put(KEYS.service("lease"), pack_lease(Lease(2**62, nonce, nonce, 10**9)))
        time.sleep(0.5)
        assert "forged" not in {i.action for i in told}
        assert guard.counts.refused == 0
        assert guard.counts.fenced == 0


def test_only_an_operator_resets(plant: Plant) -> None:
    payload = b'{"who": "jane", "why": "looked at it"}'
    with plant.open("robot") as robot:  # before its streams have begun nothing is judged, and nothing is latched
        numbers = itertools.count()
        until(lambda: stream(robot, next(numbers)) or samples(plant, robot) > 0, "the robot streams")
    for name, may in (("viewer", False), ("scene", False), ("robot", False), ("operator", True)):
        with plant.open(name) as session:
            until(lambda s=session: plant.status(s), f"{name} may ask for the status")

            def accepted(s: Any = session) -> bool:
                return any(r.ok is not None for r in s.get(KEYS.service("reset"), payload=payload, timeout=2.0))

            if may:
                until(accepted, "the operator's reset is accepted")
            else:
                assert not accepted(), name


def test_a_foreign_authority_and_no_certificate_are_refused(plant: Plant, tmp_path: Path) -> None:
    foreign = tmp_path / "foreign"
    init_security(foreign, "robot", {"scene": ["humans/pose"]})
    # a certificate of the right name by the wrong authority, whether or not it trusts ours
    (foreign / "ours.pem").write_bytes((plant.folder / "ca.pem").read_bytes())
    before = {reason: refused(plant, reason) for reason in ("UnknownCA", "UnknownIssuer", "InvalidContentType")}
    for link in (plant.link("robot", folder=foreign), plant.link("robot", "ours.pem", foreign)):
        session = _opened(link)
        if session is not None:
            with session:
                assert plant.status(session) is None
    plain = LinkSettings("client", (), (plant.endpoint.replace("tls/", "tcp/"),))
    assert _opened(plain) is None
    with plant.open("viewer") as viewer:
        until(lambda: plant.status(viewer), "who shows the right certificate is answered")
    # it distrusts us, we distrust it, it speaks no TLS: each is shown
    for reason, count in before.items():
        until(lambda r=reason, n=count: refused(plant, r) > n, f"the status shows {reason}")


def test_a_request_for_a_lease_needs_the_robots_certificate(plant: Plant) -> None:
    with plant.open("scene") as scene, plant.open("viewer") as viewer:
        for session in (scene, viewer):
            session.put(KEYS.service("lease_request"), pack_request(Request("intruder", 1, 1)))
        time.sleep(0.3)
        status = until(lambda: plant.status(viewer), "status")
        assert "intruder" not in status.guards


def test_what_lies_in_the_folder_is_never_overwritten(plant: Plant) -> None:
    with pytest.raises(BadInputError, match="never overwritten"):
        init_security(plant.folder, "robot", {})
    assert (plant.folder / "robot.key.pem").stat().st_mode & 0o077 == 0
