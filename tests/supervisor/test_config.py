"""Configuration: every mistake is one error with place, value and nearest name; the schema says the same."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path

import jsonschema
import msgspec
import pytest
from foreshock_stage import SLIP, detector, module, said

from foreshock.config import Config, DetectorEntry, PolicyEntry, config_schema, load_config, parse_config
from foreshock.errors import BadInputError, ConfigError, MissingExtraError, PluginError
from foreshock.evidence import Window
from foreshock.policy import PolicySpec, Proposal, Situation
from foreshock.registry import Registry
from foreshock.risk import LogisticExponential, RiskSettings
from foreshock.supervisor import Supervisor
from foreshock.testing import threshold_spec
from foreshock.trust import Gates, TrustSettings

GOOD = """
[supervisor]
robot = "talos"
period_s = 0.01

[window]
length_s = 1.0
kernel = "exponential"

[risk]
b = 2.5

[trust]
unobserved_cap = 0.7

[gates]
caution = 0.7
latch = "protective"

[[detectors]]
use = "lean"
channels = { value = "body/lean" }
config = { threshold = 0.2 }

[[policies]]
use = "ladder"
"""


def write(folder: Path, text: str) -> Path:
    path = folder / "robot.toml"
    path.write_text(text)
    return path


def lean() -> Registry:
    return Registry(modules={"lean": module([threshold_spec("lean", SLIP, "body/lean")])})


def test_a_good_file_gives_what_it_says(tmp_path: Path) -> None:
    config = load_config(write(tmp_path, GOOD))
    assert (config.supervisor.robot, config.supervisor.period_s) == ("talos", 0.01)
    assert config.window == Window(1.0, 0.0, "exponential")
    assert config.risk == RiskSettings(b=2.5)
    assert config.trust == TrustSettings(0.5, 0.7, 0.3)
    assert config.gates == Gates(0.7, 0.3, 0.1, 1.0, "protective")
    assert config.detectors == (DetectorEntry("lean", None, {"value": "body/lean"}, {"threshold": 0.2}),)
    Supervisor(config, tmp_path, lean())


def test_the_defaults_are_the_paper_s() -> None:
    config = parse_config({"detectors": [{"use": "lean"}]}, "here")
    assert config.risk.model == "independent"
    assert (config.risk.a, config.risk.b, config.risk.c) == (None, None, None)
    assert LogisticExponential() == LogisticExponential(1.6, 2.0, 1.2)
    assert config.gates.protective == 0.3
    assert 0.5 <= config.window.length_s <= 1.5


MISTAKES = [
    ("kernel", "kernal", "window.kernal", "did you mean 'kernel'"),
    ('kernel = "exponential"', 'kernel = "exponentail"', "window.kernel", "'exponentail'.*did you mean 'exponential'"),
    ("length_s = 1.0", 'length_s = "1.0"', "window.length_s", "got '1.0'"),
    ("length_s = 1.0", "length_s = true", "window.length_s", "True"),
    ("length_s = 1.0", "length_s = -1.0", "window.length_s", "-1.0"),
    ("length_s = 1.0", "length_s = nan", "window.length_s", "nan"),
    ("[window]", "[windows]", "windows", "did you mean 'window'"),
    ("b = 2.5", "b = nan", "risk.b", "nan"),
    ("b = 2.5", "a = 0", "risk.a", "0"),
    ("unobserved_cap = 0.7", "unobserved_cap = 7.0", "trust.unobserved_cap", "7.0"),
    ("unobserved_cap = 0.7", "grace_s = inf", "trust.grace_s", "inf"),
    ("caution = 0.7", "caution = 0.2", "gates", "0.2"),
    ('latch = "protective"', 'latch = "protectiv"', "gates.latch", "did you mean 'protective'"),
    ("period_s = 0.01", "period_s = 0.0", "supervisor.period_s", "0.0"),
    ("period_s = 0.01", "period_s = nan", "supervisor.period_s", "nan"),
    ("period_s = 0.01", "period = 0.01", "supervisor.period", "did you mean 'period_s'"),
    ("period_s = 0.01", "release_s = -1.0", "supervisor.release_s", "-1.0"),
    ('robot = "talos"', 'robot = ""', "supervisor.robot", "''"),
    ('robot = "talos"', 'robot = "a/b"', "supervisor.robot", "'a/b'"),
    ('use = "lean"', 'used = "lean"', r"detectors\[0\].used", "did you mean 'use'"),
    ('use = "lean"', "use = 3", r"detectors\[0\].use", "got 3"),
    ('use = "lean"', 'use = "lean"\nisolation = "proces"', r"detectors\[0\].isolation", "did you mean 'process'"),
    ("[[detectors]]", "[detectors]", "detectors", "array"),
    ('\nuse = "lean"\n', '\nuse = "lean"\n[[detectors]]\nuse = "lean"\n', "detectors", "'lean' is listed twice"),
]


@pytest.mark.parametrize(("right", "wrong", "place", "says"), MISTAKES, ids=[m[1] for m in MISTAKES])
def test_a_mistake_is_one_error_with_file_place_value_and_hint(
    tmp_path: Path, right: str, wrong: str, place: str, says: str
) -> None:
    assert GOOD.count(right) >= 1
    with pytest.raises(ConfigError, match=f"robot.toml: {place}.*{says}"):
        load_config(write(tmp_path, GOOD.replace(right, wrong, 1)))


WHEN_BUILT = [
    ('use = "lean"', 'use = "leen"', r"detectors\[0\].use: no plugin 'leen'.*did you mean 'lean'"),
    ('use = "ladder"', 'use = "laddder"', r"policies\[0\].use: no plugin 'laddder'.*did you mean 'ladder'"),
    ("threshold = 0.2", "treshold = 0.2", r"detectors\[0\].config: treshold: unknown key.*did you mean 'threshold'"),
    ("threshold = 0.2", 'threshold = "x"', r"detectors\[0\].config: threshold: .*got 'x'"),
    ("value =", "valu =", r"detectors\[0\].channels.valu: .*did you mean 'value'"),
]


@pytest.mark.parametrize(("right", "wrong", "says"), WHEN_BUILT, ids=[m[1] for m in WHEN_BUILT])
def test_a_mistake_that_only_a_plugin_can_see(tmp_path: Path, right: str, wrong: str, says: str) -> None:
    config = load_config(write(tmp_path, GOOD.replace(right, wrong, 1)))
    with pytest.raises(BadInputError, match=says):
        Supervisor(config, tmp_path, lean())


@pytest.mark.parametrize("data", [{}, {"detectors": []}, [], None, "x", {"detectors": "x"}])
def test_no_supervisor_without_detectors(data: object) -> None:
    """A supervisor that observes nothing would trust everything."""
    with pytest.raises(ConfigError, match="here"):
        parse_config(data, "here")


def test_not_toml_and_not_there(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"robot.toml: not TOML.*line 1"):
        load_config(write(tmp_path, "[window\n"))
    (tmp_path / "robot.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ConfigError, match=r"robot.toml: not TOML"):
        load_config(tmp_path / "robot.toml")
    with pytest.raises(ConfigError, match=r"robto.toml.*did you mean 'robot.toml'"):
        load_config(tmp_path / "robto.toml")
    with pytest.raises(ConfigError):
        load_config(tmp_path)


# ---- schema


def test_the_schema_accepts_the_good_and_refuses_the_bad() -> None:
    schema = config_schema([threshold_spec("lean", SLIP, "body/lean")])
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    validator.validate(tomllib.loads(GOOD))
    for right, wrong in [
        ("kernel", "kernal"),
        ('kernel = "exponential"', 'kernel = "exponentail"'),
        ("length_s = 1.0", 'length_s = "1.0"'),
        ('use = "lean"', "use = 3"),
        ("threshold = 0.2", "treshold = 0.2"),
        ("threshold = 0.2", 'threshold = "x"'),
        ('use = "lean"', 'use = "lean"\nisolation = "proces"'),
    ]:
        with pytest.raises(jsonschema.ValidationError):
            validator.validate(tomllib.loads(GOOD.replace(right, wrong, 1)))
    with pytest.raises(jsonschema.ValidationError):
        validator.validate({"detectors": []})
    with pytest.raises(jsonschema.ValidationError):
        validator.validate({})


def test_the_schema_keeps_settings_of_one_name_apart() -> None:
    """A stranger's settings may well be called Config, as the core's are."""
    one = msgspec.defstruct("Config", [("gain", float, 1.0)], module="stranger.one", forbid_unknown_fields=True)
    two = msgspec.defstruct(
        "Config", [("names", tuple[str, ...], ())], module="stranger.two", forbid_unknown_fields=True
    )
    specs = [
        detector("one", [SLIP], lambda now: [said(SLIP, False, now)], config=one),
        detector("two", [SLIP], lambda now: [said(SLIP, False, now)], config=two),
    ]
    schema = config_schema(specs, [PolicySpec("ladder", lambda _: _Idle(), two)])
    validator = jsonschema.Draft202012Validator(schema)
    validator.validate(
        {
            "detectors": [{"use": "one", "config": {"gain": 2.0}}, {"use": "two", "config": {"names": ["a"]}}],
            "policies": [{"use": "ladder", "config": {"names": ["b"]}}],
        }
    )
    for bad in (
        {"detectors": [{"use": "one", "config": {"names": ["a"]}}]},
        {"detectors": [{"use": "two", "config": {"gain": 2.0}}]},
        {"detectors": [{"use": "one"}], "policies": [{"use": "ladder", "config": {"gain": 1.0}}]},
        {"detectors": [{"use": "one"}], "windows": {}},
    ):
        with pytest.raises(jsonschema.ValidationError):
            validator.validate(bad)


class _Idle:
    def propose(self, situation: Situation) -> Sequence[Proposal]:
        return ()


# ---- plugins that break the contract


def supervise(registry: Registry, use: str) -> Supervisor:
    return Supervisor(Config((DetectorEntry(use),), policies=(PolicyEntry("paper-gate"),)), registry=registry)


@pytest.mark.parametrize(
    ("module_name", "error", "says"),
    [
        ("rogue_import", PluginError, "import failed: RuntimeError: no such device"),
        ("rogue_exit", PluginError, "import failed: SystemExit"),
        ("rogue_misspelt_hook", PluginError, "unknown hook 'foreshock_detector'.*did you mean 'foreshock_detectors'"),
        ("rogue_marked_hook", PluginError, "frshock_detectors"),
        ("rogue_hook_arguments", PluginError, "foreshock_detectors"),
        ("rogue_hook_raises", PluginError, "foreshock_detectors raised RuntimeError: in the hook"),
        ("rogue_foreign_spec", PluginError, "foreshock_detectors gave a str, DetectorSpec is expected"),
        ("rogue_unknown_kind", ConfigError, "unknown precursor kind 'foot-mikro-slip'.*'foot-micro-slip'"),
        ("rogue_build_raises", PluginError, r"detectors\[0\].*cannot be built: ZeroDivisionError"),
        ("rogue_missing_extra", MissingExtraError, r"run: pip install 'foreshock\[balance\]'"),
        ("rogue_other_id", ConfigError, "offers no detector"),
    ],
)
def test_a_plugin_that_breaks_the_contract_is_one_clear_error(
    module_name: str, error: type[Exception], says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    import importlib.metadata as md

    point = md.EntryPoint(module_name, module_name, "foreshock")
    real = md.entry_points(group="foreshock")
    monkeypatch.setattr(md, "entry_points", lambda **_: md.EntryPoints([*real, point]))
    registry = Registry()
    with pytest.raises(error, match=says):
        supervise(registry, module_name)
    # the others still load: load_all names the broken one only, if it is broken at import
    broken = {b.name for b in registry.load_all()}
    assert broken <= {module_name}


def test_two_plugins_cannot_share_an_id() -> None:
    spec = detector("d", [SLIP], lambda now: [said(SLIP, False, now)])
    registry = Registry(modules={"d": module([spec]), "e": module([spec])})
    registry.load("e")
    with pytest.raises(PluginError, match="'d' is taken by plugin"):
        registry.detector("d", "here")
