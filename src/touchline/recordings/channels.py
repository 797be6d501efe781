"""Channel metadata of a recording in rosbag2's format: topic names, schemas, type hashes and QoS."""

from collections.abc import Collection, Iterable
from functools import cache, lru_cache

from touchline.recordings.recorded import RecordingKind
from touchline.schemas.cdr import full_definition, type_hash
from touchline.schemas.messages.base import Message
from touchline.schemas.topics import FORMER_NAMES, TOPIC_BY_NAME, VIEWING_BY_NAME, Topic

_UNLIMITED = "{sec: 9223372036, nsec: 854775807}"
_PATHS_KEPT = 10_000
"""Size of the cache: a recording has few topics, and each message looks its own up."""


def topic_path(namespace: str, topic: Topic) -> str:
    """The absolute ROS name, ``/tt2/gnss/fix``."""
    return f"/{namespace}/{topic.name}" if namespace else f"/{topic.name}"


def topic_at(path: str) -> Topic | None:
    """Return the row of the topic table that was recorded as ``path`` in any namespace; None if there is none.

    Older recordings have other names for some.
    """
    _, name = _found(path)
    return TOPIC_BY_NAME.get(name) or FORMER_NAMES.get(name)


def namespace_at(path: str) -> str:
    """The namespace, without slashes round it, of the robot whose topic was recorded as ``path``; "" for none."""
    return _found(path)[0].strip("/")


def robots_among(paths: Iterable[str]) -> tuple[str, ...]:
    """Return the namespaces of robots with topics of the table among recorded paths, in order."""
    return tuple(dict.fromkeys(namespace_at(path) for path in paths if topic_at(path) is not None))


def is_drawn(path: str, robots: Collection[str]) -> bool:
    """Return whether ``path`` was made for viewers from the messages of one of these robots."""
    return any(path == topic_path(robot, topic) for robot in robots for topic in VIEWING_BY_NAME.values())


def present_path(path: str) -> str:
    """Return the present name of the topic recorded as ``path``, in the same namespace."""
    namespace, name = _found(path)
    return f"{namespace}/{FORMER_NAMES[name].name}" if name in FORMER_NAMES else path


def recorded_paths(path: str) -> tuple[str, ...]:
    """Return all present and former paths of a topic given by one of them; the present one first."""
    (namespace, _), topic = _found(path), topic_at(path)
    former = [name for name, known in FORMER_NAMES.items() if known is topic]
    return (present_path(path), *(f"{namespace}/{name}" for name in former))


@lru_cache(maxsize=_PATHS_KEPT)
def _found(path: str) -> tuple[str, str]:
    """Return (namespace with slashes, present or former name of the topic or "") of a recorded path."""
    parts = path.strip("/").split("/")
    for first in range(len(parts)):  # the longest name wins: supervisor/events before events
        name = "/".join(parts[first:])
        if name in TOPIC_BY_NAME or name in FORMER_NAMES:
            return "".join(f"/{part}" for part in parts[:first]), name
    return "", ""


@cache
def kind_of(message: type[Message]) -> RecordingKind:
    """Return how messages of a type are recorded: CDR, with the definitions of the type and of every type in it."""
    return RecordingKind("cdr", message.ros_type, "ros2msg", full_definition(message))


def channel_metadata(topic: Topic) -> dict[str, str]:
    """Metadata of the topic's channel; ROS 2 rebuilds the publisher from it when it replays the file."""
    return {"offered_qos_profiles": offered_qos(topic), "topic_type_hash": type_hash(topic.type)}


def offered_qos(topic: Topic) -> str:
    """Return the QoS of the topic's publisher in rosbag2's YAML (policy names, as since its metadata version 9)."""
    history, depth = ("keep_last", 1) if topic.latched else ("keep_all", 0) if topic.block else ("keep_last", 10)
    lines = (
        f"history: {history}",
        f"depth: {depth}",
        f"reliability: {'reliable' if topic.reliable else 'best_effort'}",
        f"durability: {'transient_local' if topic.latched else 'volatile'}",
        f"deadline: {_UNLIMITED}",
        f"lifespan: {_UNLIMITED}",
        "liveliness: automatic",
        f"liveliness_lease_duration: {_UNLIMITED}",
        "avoid_ros_namespace_conventions: false",
    )
    return "- " + "\n  ".join(lines)
