"""Strict reading: the first thing that does not fit is one error with its key path, at any depth."""

from __future__ import annotations

import math
from typing import Any, Literal

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from foreshock._strict import convert, read_toml, within
from foreshock.errors import ConfigError, nearest


class Leaf(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"class_": "class"}):
    size: float
    class_: Literal["red", "green"] = "red"


class Tree(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    leaves: tuple[Leaf, ...] = ()
    named: dict[str, Leaf] = {}
    best: Leaf | None = None
    free: dict[str, Any] = {}
    colour: Literal["red", "green"] | None = None


class Checked(msgspec.Struct, frozen=True):
    size: float

    def __post_init__(self) -> None:
        within("tree.size", self.size, 0.0)


GOOD = {"size": 1.0, "class": "green"}


def test_good_data_at_every_depth() -> None:
    tree = convert({"leaves": [GOOD], "named": {"x": GOOD}, "best": GOOD, "free": {"any": [1, {}]}}, Tree, "f.toml")
    assert tree.leaves[0] == tree.named["x"] == tree.best == Leaf(1.0, "green")


@pytest.mark.parametrize(
    ("data", "says"),
    [
        ({"leafs": []}, "f.toml: leafs: unknown key; did you mean 'leaves'"),
        ({"leaves": [GOOD, {"sise": 1.0}]}, "f.toml: leaves[1].sise: unknown key; did you mean 'size'"),
        ({"leaves": [{"size": 1.0, "class_": "red"}]}, "f.toml: leaves[0].class_: unknown key; did you mean 'class'"),
        ({"named": {"x": {"sise": 1.0}}}, "f.toml: named.x.sise: unknown key"),
        ({"best": {"sise": 1.0}}, "f.toml: best.sise: unknown key"),
        ({"leaves": [{"size": 1.0, "class": "gren"}]}, "f.toml: leaves[0].class: 'gren' is not one of 'red', 'green'"),
        ({"colour": "rd"}, "f.toml: colour: 'rd' is not one of"),
        ({"leaves": [GOOD, {"size": "big"}]}, "f.toml: leaves[1].size: Expected `float`, got `str`, got 'big'"),
        ({"named": {"x": {}}}, "size"),
        ([], "f.toml: Expected `object`"),
    ],
)
def test_one_error_with_place_and_hint(data: object, says: str) -> None:
    with pytest.raises(ConfigError) as e:
        convert(data, Tree, "f.toml")
    assert says in str(e.value)


def test_what_a_struct_refuses_by_itself_names_the_file_as_well() -> None:
    with pytest.raises(ConfigError, match=r"^f\.toml: tree\.size: -1\.0 is not a finite number at least 0$"):
        convert({"size": -1.0}, Checked, "f.toml")


@given(st.floats(), st.floats(-10, 10), st.floats(0, 10), st.booleans())
def test_within(value: float, least: float, width: float, above: bool) -> None:
    most = least + width
    good = not math.isnan(value) and not math.isinf(value) and least <= value <= most and (value != least or not above)
    if good:
        within("here", value, least, most, above=above)
    else:
        with pytest.raises(ConfigError, match=r"^here: "):
            within("here", value, least, most, above=above)


def test_a_folder_is_not_a_file(tmp_path: Any) -> None:
    with pytest.raises(ConfigError, match=tmp_path.name):
        read_toml(tmp_path)


def test_nearest() -> None:
    assert nearest("blance", ["balance", "grip"]) == "; did you mean 'balance'?"
    assert nearest("zzzz", ["balance", "grip"]) == "; known: balance, grip"
    assert nearest("zzzz", [f"name-{k}" for k in range(21)]) == ""
    assert nearest("x", []) == ""
