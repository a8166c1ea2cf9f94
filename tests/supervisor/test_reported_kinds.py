"""A detector whose kinds follow from its settings: only those count, and a wrong function is one clear error."""

from __future__ import annotations

from types import ModuleType

import msgspec
import pytest

from foreshock.config import parse_config
from foreshock.detector import DetectorSpec, Input
from foreshock.errors import PluginError
from foreshock.hookspecs import hookimpl
from foreshock.messages import Scalar
from foreshock.registry import Registry
from foreshock.supervisor import Supervisor


class Settings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    kinds: tuple[str, ...] = ("visual-occlusion", "id-switching")


class Silent:
    def __init__(self, settings: Settings) -> None:
        self.settings = settings

    def reset(self, seed: int) -> None:
        pass

    def update(self, now_ns, inputs):
        return ()


def supervisor(kinds: list[str] | None = None) -> Supervisor:
    spec = DetectorSpec(
        id="eyes",
        kinds=("visual-occlusion", "id-switching"),
        inputs=(Input("x", "x/y", Scalar),),
        build=Silent,
        config=Settings,
        reports=lambda settings: settings.kinds,
    )
    plugin = ModuleType("eyes")
    plugin.foreshock_detectors = hookimpl(lambda: (spec,), specname="foreshock_detectors")
    entry = {"use": "eyes", "config": {} if kinds is None else {"kinds": kinds}}
    config = parse_config({"detectors": [entry], "policies": []}, "test")
    return Supervisor(config, registry=Registry({"eyes": plugin}))


def test_only_the_reported_kinds_count_as_watched() -> None:
    assert supervisor().detectors[0].kinds == ("visual-occlusion", "id-switching")
    one = supervisor(["id-switching"])
    assert one.detectors[0].kinds == ("id-switching",)
    assert one.step((), 10_000_000).trust.unobserved == ("id-switching",)


@pytest.mark.parametrize(
    ("kinds", "says"),
    [([], "reports nothing"), (["id-swiching"], "does not declare 'id-swiching'; did you mean 'id-switching'")],
)
def test_a_wrong_answer_is_named(kinds, says) -> None:
    with pytest.raises(PluginError) as caught:
        supervisor(kinds)
    assert "detectors[0]" in str(caught.value)
    assert says in str(caught.value)
