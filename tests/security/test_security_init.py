"""``foreshock security init``: what it writes, and that it writes nothing anywhere else."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from cryptography import x509

from foreshock._strict import convert
from foreshock.errors import ConfigError
from foreshock.link import LinkSettings
from foreshock.live import init_security

pytest.importorskip("zenoh")


def init(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "foreshock", "security", "init", str(folder), *words]
    return subprocess.run(command, check=False, capture_output=True, text=True, timeout=60)


@pytest.mark.parametrize(
    "name",
    ["../evil", "a/b", "..", ".hidden", "", "a\\b", "a*", "a#", "a@b", "a\nb", "a\0b", "x" * 65, "ca", "talos.key"],
)
@pytest.mark.parametrize("whose", ["robot", "twin"])
def test_a_name_that_is_no_plain_file_name_is_refused_before_anything_is_written(
    name: str, whose: str, tmp_path: Path
) -> None:
    folder = tmp_path / "certificates"
    robot, twins = ("talos", {name: ["humans/pose"]}) if whose == "twin" else (name, {"talos": ["humans/pose"]})
    with pytest.raises(ConfigError, match=re.escape(repr(name))):
        init_security(folder, robot, twins)
    assert list(tmp_path.iterdir()) == []


def test_a_channel_that_is_no_key_expression_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    for channel in ("", "/pose", "humans//pose", "humans/pose/", "humans/po?se"):
        with pytest.raises(ConfigError, match="twin"):
            init_security(tmp_path / "certificates", "talos", {"scene": ["humans/pose", channel]})
    assert list(tmp_path.iterdir()) == []


def test_the_command_says_what_is_wrong(tmp_path: Path) -> None:
    done = init(tmp_path / "certificates", "--twin", "../evil=humans/pose")
    assert done.returncode == 2
    assert "error: twin: '../evil'" in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("words", [[], ["--naming", "rmw_zenoh", "--domain", "7"]])
def test_link_toml_is_a_link_with_the_naming_that_was_asked_for(words: list[str], tmp_path: Path) -> None:
    folder = tmp_path / "certificates"
    done = init(folder, "--twin", "scene of camera 1=humans/*", *words)
    assert done.returncode == 0, done.stderr
    link = convert(tomllib.loads((folder / "link.toml").read_text())["link"], LinkSettings, "link")
    assert (link.naming, link.domain) == (("rmw_zenoh", 7) if words else ("foreshock", 0))
    assert [r.name for r in link.access] == ["talos", "scene of camera 1", "operator", "viewer", "supervisor"]
    for rule in link.access:
        (certificate,) = x509.load_pem_x509_certificates((folder / f"{rule.name}.pem").read_bytes())
        (name,) = certificate.subject.get_attributes_for_oid(x509.NameOID.COMMON_NAME)
        assert name.value == rule.name


def test_only_the_supervisor_is_certified_where_it_is_dialled(tmp_path: Path) -> None:
    folder = tmp_path / "certificates"
    assert init(folder, "--host", "192.0.2.1", "--host", "supervisor.example").returncode == 0
    for name in ("supervisor", "talos", "operator", "viewer"):
        (certificate,) = x509.load_pem_x509_certificates((folder / f"{name}.pem").read_bytes())
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        found = {*map(str, names.get_values_for_type(x509.IPAddress)), *names.get_values_for_type(x509.DNSName)}
        assert {"localhost", "127.0.0.1", "::1"} <= found
        assert ({"192.0.2.1", "supervisor.example"} <= found) == (name == "supervisor")


def test_a_host_that_is_none_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="host: 'no host'"):
        init_security(tmp_path / "certificates", "talos", {}, ["no host"])
    assert list(tmp_path.iterdir()) == []
