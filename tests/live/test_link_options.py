"""Commands that join a link: beyond this machine, with certificates and another naming, by one file."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import msgspec
import pytest
import tomli_w

sys.path.append(str(Path(__file__).parent))
from robot import free_endpoint, supervisor, until

from foreshock.cli._link import Joining
from foreshock.errors import ConfigError
from foreshock.live import init_security

pytest.importorskip("zenoh")
ELSEWHERE = "192.0.2.1"
"""Of TEST-NET-1 (RFC 5737); nothing here dials it."""

RUN = """
[supervisor]
period_s = 0.02
[[detectors]]
use = "telemetry"
[live.streams]
"imu/torso" = "Imu"
"""


def foreshock(*words: str) -> subprocess.CompletedProcess[str]:
    done = [sys.executable, "-m", "foreshock", *words]
    return subprocess.run(done, check=False, capture_output=True, text=True, timeout=120)


@pytest.mark.parametrize(
    ("words", "option"),
    [
        (("top", "--connect", f"tcp/{ELSEWHERE}:7447"), "--connect"),
        (("reset", "--who", "jane", "--why", "x", "--connect", f"tcp/{ELSEWHERE}:7447"), "--connect"),
        (("twin", "serve", "a1-fall-onto-human", "--listen", f"tcp/{ELSEWHERE}:7448"), "--listen"),
        (("twin", "serve", "a1-fall-onto-human", "--real-time", "--connect", f"tcp/{ELSEWHERE}:1"), "--connect"),
        (("simulate", "a1-fall-onto-human", "--twin", f"zenoh:tcp/{ELSEWHERE}:7448"), "--twin"),
    ],
)
def test_an_endpoint_elsewhere_is_refused_with_the_option_that_helps(words: tuple[str, ...], option: str) -> None:
    done = foreshock(*words)
    assert done.returncode == 2
    assert f"error: {option}: 'tcp/{ELSEWHERE}" in done.stderr
    assert "link.remote = true" in done.stderr
    assert "in a file for --link" in done.stderr


def write(file: Path, **link: object) -> Path:
    file.write_text(tomli_w.dumps({"link": link}))
    return file


def test_a_file_says_how_to_join_and_options_come_before_it(tmp_path: Path) -> None:
    tls = {"ca": "ca.pem", "certificate": "viewer.pem", "key": "viewer.key.pem", "verify_name": False}
    there = f"tls/{ELSEWHERE}:7447"
    file = write(tmp_path / "viewer.toml", connect=[there], remote=True, naming="rmw_zenoh", domain=7, tls=tls)
    link = Joining(file).settings("client")
    assert (link.mode, link.listen, link.connect, link.remote) == ("client", (), (there,), True)
    assert (link.naming, link.domain, link.tls.verify_name) == ("rmw_zenoh", 7, False)
    assert link.tls.key == str(tmp_path / "viewer.key.pem")
    link = Joining(file, "tls/127.0.0.1:7447", key="here.pem").settings("peer")
    assert (link.mode, link.connect, link.tls.key) == ("peer", ("tls/127.0.0.1:7447",), "here.pem")
    assert link.tls.ca == str(tmp_path / "ca.pem")
    # what is to be stepped listens, unless it is said where to connect to
    assert Joining(file).settings("client", listen="tls/127.0.0.1:7448").connect == (there,)
    waiting = write(tmp_path / "twin.toml", remote=True)
    link = Joining(waiting).settings("client", listen=f"tcp/{ELSEWHERE}:7448")
    assert (link.mode, link.listen, link.connect) == ("peer", (f"tcp/{ELSEWHERE}:7448",), ())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "link: missing"),
        ("link = 3", "link: missing"),
        ("[link]\nlisten = []", "link.listen: is for a supervisor"),
        ("[link]\nconect = []", "link.conect: unknown key; did you mean 'connect'"),
        ("[link]\ntls = 'x'", "link.tls: Expected"),
        ("[link]\nconnect = 'x'", "link.connect: Expected"),
        (f"[link]\nconnect = ['tcp/{ELSEWHERE}:7447']", "link.connect: 'tcp/192.0.2.1:7447' is beyond this machine"),
    ],
)
def test_a_wrong_file_is_named_with_the_place(text: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "x.toml"
    file.write_text(text)
    with pytest.raises(ConfigError) as e:
        Joining(file).settings("client")
    assert str(e.value).startswith(f"{file}: {message}")


def test_a_supervisor_of_rmw_zenoh_with_certificates_is_joined_by_files(tmp_path: Path) -> None:
    folder = tmp_path / "here"
    init_security(folder, "talos", {}, naming="rmw_zenoh", domain=7)
    endpoint = free_endpoint().replace("tcp/", "tls/")
    link = tomllib.loads((folder / "link.toml").read_text())["link"] | {"listen": [endpoint]}
    text = RUN + tomli_w.dumps({"link": link})
    files = {}
    for name in ("talos", "viewer", "operator"):
        tls = {"ca": "ca.pem", "certificate": f"{name}.pem", "key": f"{name}.key.pem"}
        file = write(folder / f"{name}.toml", connect=[endpoint], naming="rmw_zenoh", domain=7, tls=tls)
        files[name] = ("--link", str(file))
    words = ("twin", "serve", "a1-fall-onto-human", "--real-time", "--seed", "3", *files["talos"])
    with supervisor(folder, endpoint, text.replace("{", "{{").replace("}", "}}")):
        robot = subprocess.Popen([sys.executable, "-m", "foreshock", *words], stderr=subprocess.DEVNULL)
        try:

            def streams() -> bool:
                done = foreshock("top", *files["viewer"], "--json")
                result = msgspec.json.decode(done.stdout)["result"]
                return bool(result) and all(s["counts"]["samples"] > 0 for s in result["streams"].values())

            until(streams, "the twin's streams arrive")
            until(lambda: "may move" in foreshock("top", *files["viewer"], "--once").stdout, "it may move")
            done = foreshock("reset", "--who", "jane", "--why", "looked at it", *files["operator"])
            assert done.stdout == "released everything by jane: looked at it\n"
        finally:
            robot.terminate()
            robot.wait(20)


def test_a_stepped_twin_with_certificates_is_joined_by_a_file(tmp_path: Path) -> None:
    folder = tmp_path / "here"
    init_security(folder, "talos", {})
    endpoint = free_endpoint().replace("tcp/", "tls/")
    tls = {"ca": "ca.pem", "certificate": "talos.pem", "key": "talos.key.pem"}
    file = str(write(folder / "twin.toml", tls=tls))
    command = [sys.executable, "-m", "foreshock", "twin", "serve", "a1-fall-onto-human", "--listen", endpoint]
    server = subprocess.Popen([*command, "--link", file], stderr=subprocess.PIPE, text=True)
    try:
        assert server.stderr is not None
        assert endpoint in server.stderr.readline()
        words = ("simulate", "a1-fall-onto-human", "--duration", "0.2", "--twin", f"zenoh:{endpoint}")
        done = foreshock(*words, "--link", file)
        assert done.returncode == 0, done.stderr
        assert "outcome: " in done.stdout
        refused = foreshock("simulate", "a1-fall-onto-human", "--link", file)
        assert refused.returncode == 2
        assert "--link: a twin of kind 'fmu' runs here" in refused.stderr
    finally:
        server.terminate()
        server.wait(20)
        if server.stderr is not None:
            server.stderr.close()
