"""``foreshock security init``: what it writes, and that it writes nothing anywhere else."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner
from cryptography import x509

from foreshock._strict import convert
from foreshock.cli import cli
from foreshock.errors import ConfigError
from foreshock.link import LinkSettings
from foreshock.live import init_security

pytest.importorskip("zenoh")


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
    words = ["security", "init", str(tmp_path / "certificates"), "--twin", "../evil=humans/pose"]
    result = CliRunner().invoke(cli, words)
    assert isinstance(result.exception, ConfigError)
    assert "'../evil'" in str(result.exception)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("words", [[], ["--naming", "rmw_zenoh", "--domain", "7"]])
def test_link_toml_is_a_link_with_the_naming_that_was_asked_for(words: list[str], tmp_path: Path) -> None:
    folder = tmp_path / "certificates"
    result = CliRunner().invoke(cli, ["security", "init", str(folder), "--twin", "scene of camera 1=humans/*", *words])
    assert result.exit_code == 0, result.output
    link = convert(tomllib.loads((folder / "link.toml").read_text())["link"], LinkSettings, "link")
    assert (link.naming, link.domain) == (("rmw_zenoh", 7) if words else ("foreshock", 0))
    assert [r.name for r in link.access] == ["talos", "scene of camera 1", "operator", "viewer", "supervisor"]
    for rule in link.access:
        (certificate,) = x509.load_pem_x509_certificates((folder / f"{rule.name}.pem").read_bytes())
        (name,) = certificate.subject.get_attributes_for_oid(x509.NameOID.COMMON_NAME)
        assert name.value == rule.name
