"""``foreshock doctor``: right beside a healthy supervisor, and beside one that is not."""

from __future__ import annotations

import datetime
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import msgspec
import pytest
import tomli_w
import trustme

sys.path.append(str(Path(__file__).parent))
from robot import CONFIG, Robot, free_endpoint, supervisor, until

from foreshock.link import LinkSettings, TlsSettings
from foreshock.live import init_security

pytest.importorskip("zenoh")
CHANNEL = "robot/left_gripper/state"


def doctor(file: Path) -> tuple[int, dict[str, tuple[bool | None, str]]]:
    """Exit code, and what was found by what was checked."""
    words = [sys.executable, "-m", "foreshock", "doctor", str(file), "--json"]
    done = subprocess.run(words, check=False, capture_output=True, text=True, timeout=60)
    found = msgspec.json.decode(done.stdout)["result"]
    return done.returncode, {f["what"]: (f["fine"], f["found"]) for f in found}


def secured(folder: Path, endpoint: str, **replaced: Any) -> str:
    """The text of a run's file with the tables of ``security init``, some replaced."""
    link = tomllib.loads((folder / "link.toml").read_text())["link"] | {"listen": [endpoint], **replaced}
    tables = tomli_w.dumps({"link": link}).replace("{", "{{").replace("}", "}}")
    head, _, rest = CONFIG.partition("[link]")
    return head + tables + rest.partition("\n\n")[2]


@pytest.mark.parametrize("rules", ["of init", "without the supervisor's"])
def test_beside_a_secured_supervisor_it_asks_where_it_may_and_is_never_turned_away(tmp_path: Path, rules: str) -> None:
    folder = tmp_path / "here"
    init_security(folder, "robot", {})
    endpoint = free_endpoint().replace("tcp/", "tls/")
    access = tomllib.loads((folder / "link.toml").read_text())["link"]["access"]
    if rules != "of init":
        access = [r for r in access if r["name"] != "supervisor"]
    tls = TlsSettings(*(str(folder / name) for name in ("ca.pem", "robot.pem", "robot.key.pem")))
    link = LinkSettings("peer", (), (endpoint,), tls=tls)
    with supervisor(folder, endpoint, secured(folder, endpoint, access=access)), Robot(endpoint, link=link) as robot:
        until(robot.guard.permitted, "the robot may move")
        code, found = doctor(folder / "run.toml")
        status = until(robot.status, "a status")
        assert status.denied == ()
        assert status.refused == ()
    assert found["certificate"][0] is True
    if rules == "of init":
        assert [what for what, (fine, _) in found.items() if fine is False] == []
        assert code == 0
        assert found[CHANNEL][0] is True
        assert found["link"][1].startswith("a supervisor of robot answers")
    else:
        assert code == 1
        assert "no access rule lets 'supervisor' ask foreshock/robot/@/status" in found["link"][1]


def test_a_stream_that_is_slower_than_a_detector_needs_is_not_fine(tmp_path: Path) -> None:
    """First fast, so that the mean since the start hides it."""
    endpoint = free_endpoint()
    text = CONFIG.replace('use = "grip"', 'use = "grip"\nconfig = {{ min_rate_hz = 20.0, max_age_s = 0.5 }}')
    with supervisor(tmp_path, endpoint, text), Robot(endpoint) as robot:
        until(robot.guard.permitted, "the robot may move")
        code, found = doctor(tmp_path / "run.toml")
        assert (code, found[CHANNEL][0]) == (0, True), found
        robot.period_s = 0.2
        until(lambda: (s := robot.status()) and "grip" in s.health, "grip is unobserved")
        code, found = doctor(tmp_path / "run.toml")
        assert code == 1
        fine, said = found[CHANNEL]
        assert fine is False
        assert "at least 20 are needed" in said
        assert 4 <= int(said.split()[0]) <= 6, "of the last second, not since the start"
        assert found["health of grip"] == (False, until(robot.status, "a status").health["grip"])


def test_what_withholds_the_lease_is_not_fine(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    with supervisor(tmp_path, endpoint), Robot(endpoint, streaming=False) as robot:
        until(robot.status, "a status")
        code, found = doctor(tmp_path / "run.toml")
    assert code == 1
    assert found["motion"] == (False, f"withheld: waiting for {CHANNEL}")
    assert found[CHANNEL][0] is False


def issued(folder: Path, **dates: datetime.datetime) -> None:
    """Another authority, and a certificate of it."""
    authority = trustme.CA()
    authority.cert_pem.write_to_path(str(folder / "ca.pem"))
    leaf = authority.issue_cert("127.0.0.1", common_name="supervisor", **dates)  # type: ignore[arg-type]
    leaf.private_key_pem.write_to_path(str(folder / "supervisor.key.pem"))
    leaf.cert_chain_pems[0].write_to_path(str(folder / "supervisor.pem"))


def test_certificates_are_verified_against_the_authority(tmp_path: Path) -> None:
    folder = tmp_path / "here"
    init_security(folder, "robot", {})
    file = folder / "run.toml"
    file.write_text(secured(folder, free_endpoint().replace("tcp/", "tls/")).format())
    assert doctor(file)[1]["certificate"][0] is True

    def refused() -> str:
        code, found = doctor(file)
        assert code == 1
        assert found["certificate"][0] is False
        return found["certificate"][1]

    files = {name: (folder / name).read_bytes() for name in ("ca.pem", "supervisor.pem", "supervisor.key.pem")}
    (folder / "supervisor.key.pem").write_bytes((folder / "robot.key.pem").read_bytes())
    assert "supervisor.key.pem" in refused()  # the key is another's
    (folder / "supervisor.key.pem").unlink()
    assert "supervisor.key.pem" in refused()
    issued(folder)
    assert doctor(file)[1]["certificate"][0] is True
    (folder / "ca.pem").write_bytes(files["ca.pem"])
    assert "ca.pem" in refused()  # the certificate is of another authority
    long_ago = datetime.datetime(2020, 1, 1, tzinfo=datetime.UTC)
    issued(folder, not_before=long_ago, not_after=long_ago + datetime.timedelta(days=30))
    assert "expired" in refused()
