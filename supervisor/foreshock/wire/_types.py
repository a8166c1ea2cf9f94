"""ROS 2 message definitions, with their RIHS01 hashes: rosbags' own, vision_msgs, and our foreshock_msgs."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import Any

from foreshock.errors import MissingExtraError

__all__ = ["definitions", "rihs01", "ros_type", "typestore"]


def definitions() -> dict[str, str]:
    """The .msg files that ship with Foreshock, by type name, e.g. ``foreshock_msgs/msg/Lease``."""
    root = files("foreshock").joinpath("data/msg")
    return {
        f"{package.name}/msg/{file.name.removesuffix('.msg')}": file.read_text()
        for package in sorted(root.iterdir(), key=lambda p: p.name)
        for file in sorted(package.joinpath("msg").iterdir(), key=lambda p: p.name)
    }


@cache
def typestore() -> Any:
    """The rosbags typestore of ROS 2 Jazzy with our definitions.

    Raises:
        MissingExtraError: rosbags is not installed.
    """
    try:
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore
    except ImportError as e:
        raise MissingExtraError("wire", f"{e.name} is not installed", "; run: pip install 'foreshock[zenoh]'") from e
    store = get_typestore(Stores.ROS2_JAZZY)
    added: dict[str, Any] = {}
    for name, text in definitions().items():
        added.update(get_types_from_msg(text, name))
    store.register(added)
    return store


def ros_type(name: str) -> Any:
    """The class of a ROS 2 type, e.g. ``std_msgs/msg/Header``."""
    return typestore().types[name]


@cache
def rihs01(name: str) -> str:
    """The type's hash by REP 2016, e.g. ``RIHS01_df66...``."""
    return str(typestore().hash_rihs01(name))
