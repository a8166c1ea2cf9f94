"""Plugins that cannot be loaded: each gives one clear error, and none takes the others with it."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import pytest
from tests.rogues.plugins.entry_points import GALLERY, install

from foreshock.config import parse_config
from foreshock.errors import BadInputError, ConfigError, PluginError
from foreshock.hookspecs import hookimpl
from foreshock.registry import Registry
from foreshock.supervisor import Supervisor
from foreshock.taxonomy import builtin_taxonomy


@pytest.fixture
def registry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Registry:
    """The gallery, installed beside what is installed anyway."""
    monkeypatch.syspath_prepend(str(install(tmp_path / "gallery")))
    return Registry()


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("bad-import", ["plugin bad-import", "import failed", "foreshock.detektor"]),
        ("exits", ["plugin exits", "import failed", "this plugin needs a licence"]),
        ("misspelt-hook", ["plugin misspelt-hook", "'foreshock_detector'", "did you mean 'foreshock_detectors'"]),
        ("misspelt-unmarked", ["plugin misspelt-unmarked", "'foreshock_presursors'", "'foreshock_precursors'"]),
        ("wrong-signature", ["plugin wrong-signature", "foreshock_detectors", "config"]),
        ("raises", ["plugin raises", "foreshock_detectors raised ZeroDivisionError"]),
        ("gives-names", ["plugin gives-names", "gave a str", "DetectorSpec is expected"]),
        ("gives-nothing", ["plugin gives-nothing", "foreshock_detectors", "NoneType"]),
        ("other-id", ["other-id", "offers no detector 'other-id'", "knee-torque"]),
        ("knee-torqe", ["detectors[0].use", "no plugin 'knee-torqe'", "did you mean 'knee-torque'"]),
    ],
)
def test_a_plugin_that_cannot_be_used_is_one_clear_error(registry: Registry, name: str, says: list[str]) -> None:
    with pytest.raises(BadInputError) as caught:
        registry.detector(name, "detectors[0].use")
    message = str(caught.value)
    assert [part for part in says if part not in message] == []
    assert "Traceback" not in message


@pytest.mark.parametrize("name", sorted(set(GALLERY) - {"knee-torque"}))
def test_a_broken_plugin_hides_no_other(registry: Registry, name: str) -> None:
    """Only what the configuration names is loaded; and a failed load leaves nothing behind."""
    try:
        registry.detector(name, "detectors[0].use")
    except BadInputError:
        pass
    else:
        assert name in ("bad-kind", "needs-extra")  # these fail later: when they are built
    fresh = Registry()
    assert fresh.detector("knee-torque", "detectors[0].use").id == "knee-torque"


def test_load_all_names_every_plugin_that_does_not_load(registry: Registry) -> None:
    broken = {b.name: b.reason for b in registry.load_all() if b.name in GALLERY}
    assert set(broken) == {"bad-import", "exits", "misspelt-hook", "misspelt-unmarked", "unmarked", "wrong-signature"}
    assert all(f"plugin {name}" in reason for name, reason in broken.items())


def test_a_failed_load_is_an_error_each_time(registry: Registry) -> None:
    """The second attempt must not pass because the first one left the module registered."""
    for _ in range(2):
        with pytest.raises(PluginError):
            registry.load("misspelt-hook")


def test_only_what_is_named_is_imported(registry: Registry) -> None:
    config = parse_config({"detectors": [{"use": "knee-torque"}], "policies": []}, "test")
    supervisor = Supervisor(config, registry=registry)
    assert [spec.id for spec in supervisor.detectors] == ["knee-torque"]
    supervisor.close()


@pytest.mark.parametrize(
    ("entry", "says"),
    [
        ({"use": "needs-extra"}, ["detectors[0]", "thermal_camera_driver", "not installed", "pip install"]),
        ({"use": "knee-torque", "channels": {"torqe": "hip/torque"}}, ["detectors[0].channels.torqe", "'torque'"]),
        ({"use": "knee-torque", "config": {"limit": 3.0}}, ["detectors[0].config", "limit", "'limit_n_m'"]),
        ({"use": "knee-torque", "config": {"limit_n_m": "3"}}, ["detectors[0].config", "limit_n_m", "'3'"]),
        ({"use": "bad-kind", "config": {"limit": 1.0}}, ["detectors[0]", "OSError: no such device"]),
    ],
)
def test_an_entry_that_does_not_fit_names_place_and_value(
    registry: Registry, entry: dict[str, object], says: list[str]
) -> None:
    with pytest.raises(BadInputError) as caught:
        Supervisor(parse_config({"detectors": [entry], "policies": []}, "test"), registry=registry)
    assert [part for part in says if part not in str(caught.value)] == []


def test_a_misspelt_kind_names_the_nearest(registry: Registry) -> None:
    """The build of bad-kind fails first; the kind alone is judged by the taxonomy."""
    spec = registry.detector("bad-kind", "detectors[0].use")
    with pytest.raises(ConfigError, match="did you mean 'torque-saturation'"):
        builtin_taxonomy().kind(spec.kinds[0], "detector bad-kind")


def test_two_plugins_with_one_id_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plugins = {"knee-torque": "good_knee", "other-id": "rogue_other_id"}
    monkeypatch.syspath_prepend(str(install(tmp_path / "twice", plugins)))
    registry = Registry()
    registry.load("knee-torque")
    registry.load("other-id")
    with pytest.raises(PluginError, match="id 'knee-torque' is taken by plugin"):
        registry.detectors()


@pytest.mark.parametrize("name", ["telemetri", "ladder", "ladde", "fmu", "x"])
def test_a_wrong_detector_is_answered_with_detectors_only(name: str) -> None:
    """Also where nothing has been loaded, and where the name is that of a policy or twin."""
    with pytest.raises(ConfigError) as caught:
        Registry().detector(name, "detectors[0].use")
    assert [word for word in ("ladder", "paper-gate", "fmu", "plants") if word in caught.value.hint] == []
    assert "telemetry" in caught.value.hint or name != "telemetri"


@pytest.mark.parametrize(("name", "nearest"), [("balance", "ladder"), ("lader", "ladder"), ("papergate", "paper-gate")])
def test_a_wrong_policy_is_answered_with_policies_only(name: str, nearest: str) -> None:
    with pytest.raises(ConfigError) as caught:
        Registry().policy(name, "policies[0].use")
    assert nearest in caught.value.hint
    assert [word for word in ("telemetry", "grip", "fmu", "plants") if word in caught.value.hint] == []


def test_a_wrong_twin_is_answered_with_twins_only() -> None:
    with pytest.raises(ConfigError) as caught:
        Registry().twin("balance", "twin.kind")
    assert "fmu" in caught.value.hint
    assert "ladder" not in caught.value.hint


def test_a_hint_passes_over_broken_plugins_and_loads_nothing(registry: Registry) -> None:
    """The registry that was asked stays as it was: a hint must not extend what a caller goes on with."""
    with pytest.raises(ConfigError, match="did you mean 'knee-torque'"):
        registry.detector("knee-torq", "detectors[0].use")
    assert registry.detectors() == ()


def _offers(*files: object) -> ModuleType:
    module = ModuleType("offers")
    module.foreshock_scenarios = hookimpl(lambda: files)  # type: ignore[attr-defined]  # a module made by hand
    return module


def test_scenario_files_name_their_plugin() -> None:
    """A bad hook is strict for scenarios(), and hides no other plugin's files from scenario_files()."""
    b, a = Path("/nowhere/b.toml"), Path("/nowhere/a.toml")
    registry = Registry({"second": _offers(a), "first": _offers(b, a), "third": _offers(a, "c.toml")})
    for name in ("first", "second", "third"):
        registry.load(name)
    files, broken = registry.scenario_files()
    assert files == (("first", a), ("first", b), ("second", a))
    assert [(x.name, "gave a str, Path is expected" in x.reason) for x in broken] == [("third", True)]
    with pytest.raises(PluginError, match="plugin third"):
        registry.scenarios()
