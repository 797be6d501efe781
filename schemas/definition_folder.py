"""The definitions of all types that go to and from ROS 2, as a folder of message packages.

Ours are written as they are shipped, and are ready for colcon. Of ROS 2's standard packages it has the types that ours
build on and that our topics and services have: clients that work without ROS 2 look them up there, and need no network.
"""

import re
from collections.abc import Iterator
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, Final

from rosbags.interfaces import Nodetype

from touchline.schemas import topics
from touchline.schemas.cdr import EVENT_INFO, OWN, STANDARD, typestore
from touchline.schemas.messages import PoseStamped

_README: Final = """Definitions of ROS 2's standard types, for clients that work without ROS 2; without comments and
default values. They are those of ROS 2 Jazzy (builtin_interfaces, common_interfaces, rcl_interfaces and others),
Copyright Open Source Robotics Foundation, Inc. and others, licensed under the Apache License 2.0, a copy of which is
beside this file. Where ROS 2 is installed, use its own packages.
"""


def used_types() -> set[str]:
    """ROS types of all topics, of services' requests and responses, of goals, and of all that is in them."""
    services = (*topics.SERVICES, topics.FOLLOWER_STEP, *topics.PARAMETER_SERVICES)
    found: set[str] = set()
    kinds = [topic.type for topic in (*topics.TOPICS, *topics.VIEWING)]
    kinds += [part for s in services for part in (s.request, s.response)]
    pending = [EVENT_INFO, PoseStamped.ros_type, *(kind.ros_type for kind in kinds)]
    pending += [name for name in typestore().fielddefs if name.split("/")[0] in _packages(OWN)]
    while pending:
        name = pending.pop()
        if name not in found:
            found.add(name)
            pending += [inner for _, field in typestore().fielddefs[name][1] for inner in _named(field)]
    return found


def write_definitions(folder: Path) -> list[str]:
    """Write the packages into ``folder``; returns their names.

    Raises:
        FileExistsError: One of them is there already.
        OSError: The folder cannot be written.
    """
    license_text = (files("touchline.schemas") / OWN / "touchline_msgs" / "LICENSE").read_text(encoding="utf-8")
    texts = {place: entry.read_text(encoding="utf-8") for root in (OWN, STANDARD) for place, entry in _shipped(root)}
    for name in used_types():
        package, kind, message = name.split("/")
        if package not in _packages(OWN) and kind == "msg":
            text, _ = typestore().generate_msgdef(name, ros_version=2)
            texts[f"{package}/msg/{message}.msg"] = re.split(r"^=+$", text, maxsplit=1, flags=re.MULTILINE)[0]
    packages = sorted({place.split("/")[0] for place in texts})
    for package in packages:
        if (folder / package).exists():
            raise FileExistsError(str(folder / package))
    for package in packages:
        (folder / package).mkdir(parents=True)
        if package not in _packages(OWN):
            texts |= {f"{package}/LICENSE": license_text, f"{package}/README": _README}
    for place, text in texts.items():
        (folder / place).parent.mkdir(exist_ok=True)
        (folder / place).write_text(text, encoding="utf-8")
    return packages


def _packages(root: str) -> list[str]:
    return [entry.name for entry in (files("touchline.schemas") / root).iterdir() if entry.is_dir()]


def _shipped(root: str) -> Iterator[tuple[str, Traversable]]:
    """(path from ``root``, file) of every shipped file below it."""
    pending = [(entry.name, entry) for entry in (files("touchline.schemas") / root).iterdir()]
    while pending:
        place, entry = pending.pop()
        if entry.is_dir():
            pending += [(f"{place}/{inner.name}", inner) for inner in entry.iterdir()]
        else:
            yield place, entry


def _named(field: Any) -> list[str]:
    """The types of messages in a field."""
    node, detail = field
    if node == Nodetype.NAME:
        return [str(detail)]
    return [] if node == Nodetype.BASE else _named(detail[0])
