"""First difference between a session and its rebuild: messages of each topic paired in order of sim time."""

from __future__ import annotations

import math
import struct
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.checking.session_metrics import MetricKeeper, SessionMetric
from touchline.recordings.alignment import Alignment
from touchline.recordings.channels import kind_of
from touchline.recordings.field_differences import Unequal, unequal_fields
from touchline.recordings.message_table import MessageTable
from touchline.recordings.recorded import Recorded, RecordingKind
from touchline.recordings.recorder import is_stamped
from touchline.recordings.robot_time import RobotTime
from touchline.recordings.schema_change import SchemaChange, schema_change
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.layout import Payloads
from touchline.schemas.messages import Event
from touchline.schemas.topics import Topic
from touchline.services.robot_sim.packing import Payload

PLAN, WORLD, SENSORS, ESTIMATOR, PERCEPTION, FOLLOWER, EXECUTIVE, PAINT = PARTS = (
    "plan",
    "world",
    "sensors",
    "estimator",
    "perception",
    "follower",
    "executive",
    "paint",
)
"""Components of a robot, each before those that depend on it within a tick."""
PART_OF: Final[Mapping[str, str]] = {
    topics.PLAN.name: PLAN,
    topics.TEMPLATE.name: PLAN,
    topics.TRUTH.name: WORLD,
    topics.BATTERY.name: WORLD,
    topics.SPRAYER.name: WORLD,
    topics.GNSS_FIX.name: SENSORS,
    topics.GNSS_STATUS.name: SENSORS,
    topics.CAMERA_POSE.name: SENSORS,
    topics.SENSOR_SAMPLE.name: SENSORS,
    topics.SCAN.name: SENSORS,
    topics.RANGE.name: SENSORS,
    topics.CONTACT_REPORT.name: WORLD,
    topics.IMU.name: SENSORS,
    topics.MAGNETIC_FIELD.name: SENSORS,
    topics.JOINT_STATES.name: SENSORS,
    topics.ODOMETRY.name: ESTIMATOR,
    topics.ESTIMATOR.name: ESTIMATOR,
    topics.OBSTACLES.name: PERCEPTION,
    topics.WAY_ROUND.name: EXECUTIVE,
    topics.STOP_ZONE.name: EXECUTIVE,
    topics.SLOW_ZONE.name: EXECUTIVE,
    topics.ACTUATOR_COMMAND.name: FOLLOWER,
    topics.STATUS.name: EXECUTIVE,
    topics.PAUSE_STATUS.name: EXECUTIVE,
    topics.ABOUT_TO_MOVE.name: EXECUTIVE,
    topics.WHEREABOUTS.name: EXECUTIVE,
    topics.PLAN_STATE.name: EXECUTIVE,
    topics.EVENTS.name: EXECUTIVE,
    topics.PAINT.name: PAINT,
    topics.TRUE_COVERAGE.name: PAINT,
    topics.AREA.name: PAINT,
    topics.AREA_REPORT.name: PAINT,
    topics.REPORT.name: PAINT,
}
TOLD_FROM_OUTSIDE: Final = frozenset(
    (
        "journal",
        "goal",
        "goal-refused",
        "start-refused",
        "watchdog",
        "link-lost",
        "shut-down",
        "stranger",
        "coordinator-lost",
        "tank-refilled",
        "battery-replaced",
    )
)
"""Events of the robot's process, which are not rebuilt."""
_LATE: Final = frozenset(
    each.name
    for each in (
        topics.GNSS_FIX,
        topics.GNSS_STATUS,
        topics.CAMERA_POSE,
        topics.SENSOR_SAMPLE,
        topics.SCAN,
        topics.RANGE,
    )
)
"""Their stamps are times of measurement; their times of arrival matter, too."""
_STANDING: Final = frozenset((topics.STATUS.name, topics.TRUE_COVERAGE.name))
_AWAKE: Final = frozenset(each.name for each in (topics.ODOMETRY, topics.GNSS_STATUS, topics.SPRAYER, topics.BATTERY))
"""Topics that are also published when the process begins and before a job: see `Telemetry.awake`."""
_HASH: Final = "session_hash"
"""Field of a report that follows from all others."""
_SIDES: Final = ("the recording", "today")
_STAMP: Final = struct.Struct("<4xiI")


@dataclass(frozen=True)
class Divergence:
    """First difference of a topic.

    Attributes:
        time_s: Sim time.
        topic: Name in the topic table.
        field: Path of the field; empty if a message is missing.
        recorded, today: Both values.
        unit: Unit of the values; empty if there is none.
    """

    time_s: float
    topic: str
    field: str
    recorded: str
    today: str
    unit: str = ""

    @property
    def part(self) -> str:
        """Component that the topic belongs to."""
        return PART_OF[self.topic]

    def __str__(self) -> str:
        """Return it as one line for a person."""
        unit = f" {self.unit}" if self.unit else ""
        what = f" {self.field}" if self.field else ""
        return f"at {self.time_s:.2f} s {self.topic}{what}: recorded {self.recorded}, today {self.today}{unit}"


@dataclass
class TopicCheck:
    """Comparison of a topic.

    Attributes:
        pairs: Number of messages with a counterpart.
        different: How many of these differ.
        only_recorded, only_today: Messages without a counterpart.
        largest: Largest difference of a number, with field and unit.
        first: First difference; None if there is none.
    """

    pairs: int = 0
    different: int = 0
    only_recorded: int = 0
    only_today: int = 0
    largest: float = 0.0
    largest_field: str = ""
    unit: str = ""
    first: Divergence | None = None

    @property
    def same(self) -> bool:
        """True if nothing differs."""
        return self.first is None


@dataclass
class SessionDiff:
    """Pairs recorded messages with present ones as both arrive.

    Attributes:
        topics_recorded: Names of the recorded topics: others do not count.
        exact: Whether every bit counts, else each topic's tolerance.
        from_ns: Sim time at which the recording begins: earlier messages do not count.
        ordered_ns: Sim time of the first order: latched states until then do not count, as they are sent when the
            process begins, or on request.
        loaded_ns: Sim times of the loads: what a standing robot knows then, or at 0, does not count, as older
            recordings do not have it.
        broken_off: Whether the recording is cut off: messages of a topic after its last recorded one do not count.
        topics: By name in the topic table.
        time: The robot's clock when the session begins.
        schemas: Changes in how topics are recorded, by topic.
        wanted: Names of the topics to compare.
    """

    topics_recorded: Collection[str] = frozenset(PART_OF)
    exact: bool = True
    from_ns: int = 0
    ordered_ns: int = -1
    broken_off: bool = False
    loaded_ns: frozenset[int] = frozenset()
    topics: dict[str, TopicCheck] = field(default_factory=dict)
    time: RobotTime = field(default_factory=RobotTime)
    schemas: dict[str, tuple[str, ...]] = field(default_factory=dict)
    wanted: frozenset[str] = field(init=False)
    _going: dict[str, Alignment] = field(default_factory=dict)
    _kept: MetricKeeper = field(default_factory=MetricKeeper)
    _newest_ns: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Prepare the alignment of topics."""
        self.wanted = frozenset(PART_OF.keys() & self.topics_recorded)

    def recorded(self, topic: Topic, message: Recorded) -> None:
        """Take a message of the recording."""
        if self._counts(topic, message.payload):
            timed = message if is_stamped(topic) else message._replace(publish_time_ns=0)
            self._newest_ns[topic.name] = max(self._newest_ns.get(topic.name, -1), timed.publish_time_ns)
            self._add(topic, 0, timed)

    def present(self, payloads: Iterable[Payload]) -> None:
        """Take messages of the present run."""
        for topic, payload in payloads:
            if topic.name in self.topics_recorded and is_stamped(topic):
                self.time.hear(stamp_ns(payload), topic is topics.CLOCK)
            if topic.name in self.wanted and self._counts(topic, payload):
                at_ns = stamp_ns(payload) if is_stamped(topic) else 0
                self._add(topic, 1, Recorded(topic.name, self.time.log_ns, at_ns, 0, payload, kind_of(topic.type)))

    def take_equal(
        self, recorded: Mapping[str, MessageTable], present: Iterable[Iterable[tuple[Topic, Payloads]]]
    ) -> bool:
        """Take all of both if every topic has the same payloads in the same order; else return False and take nothing.

        Args:
            recorded: By name in the topic table.
            present: One slice of the session after the other.
        """
        then = {name: table.payloads for name, table in recorded.items() if name in self.wanted}
        now: dict[str, list[Payloads]] = {}
        for topic, payloads in (each for part in present for each in part):
            if topic.name in self.wanted:
                now.setdefault(topic.name, []).append(payloads)
        found: dict[str, TopicCheck] = {}
        for name in then.keys() | now.keys():
            topic = topics.TOPIC_BY_NAME[name]
            if name in then and recorded[name].kind != kind_of(topic.type):
                return False
            todays = self._counted(topic, Payloads.joined(now.get(name, [])))
            ours = self._counted(topic, then.get(name, Payloads([], b"")))
            if ours != todays:
                return False
            if ours.sizes:
                found[name] = TopicCheck(pairs=len(ours.sizes))
        self.topics.update(found)
        return True

    def _counted(self, topic: Topic, payloads: Payloads) -> Payloads:
        """Return the payloads that count."""
        by_stamp = is_stamped(topic) and topic is not topics.EVENTS and topic.name not in _STANDING
        if by_stamp:
            stamps_ns = _stamps_ns(payloads)
            awake = topic.name in _AWAKE and np.isin(stamps_ns, [0, *self.loaded_ns]).any()
            if not awake and stamps_ns.min(initial=self.from_ns) >= self.from_ns:
                return payloads
        each = payloads.each()
        counts = [payload for payload in each if self._counts(topic, payload)]
        return payloads if len(counts) == len(each) else Payloads.of(counts)

    @property
    def metrics(self) -> tuple[SessionMetric, ...]:
        """Main figures of both sessions."""
        return self._kept.metrics

    def end(self) -> None:
        """End the comparison: nothing more comes."""
        for name, alignment in self._going.items():
            alignment.end(0)
            alignment.end(1)
            self._decide(topics.TOPIC_BY_NAME[name], alignment)

    @staticmethod
    def kind_of(topic: Topic) -> RecordingKind:
        """Return how present payloads of a topic are read."""
        return kind_of(topic.type)

    @property
    def first(self) -> Divergence | None:
        """First difference in sim time; of topics at the same time that of the earliest component."""
        found = [check.first for check in self.topics.values() if check.first is not None]
        return min(found, key=lambda each: (each.time_s, PARTS.index(each.part)), default=None)

    def _counts(self, topic: Topic, payload: bytes) -> bool:
        """Return whether a message is of the robot, not of its process or from before the session."""
        if is_stamped(topic):
            at_ns = stamp_ns(payload)
            if at_ns < self.from_ns or (topic.name in _STANDING and at_ns <= self.ordered_ns):
                return False
            if topic.name in _AWAKE and (at_ns == 0 or at_ns in self.loaded_ns):
                return False
        if topic is not topics.EVENTS:
            return True
        event = decode(Event, payload)
        return event.source == topics.ROBOT_SIM and event.code not in TOLD_FROM_OUTSIDE

    def _add(self, topic: Topic, side: int, message: Recorded) -> None:
        alignment = self._going.get(topic.name)
        if alignment is None:
            alignment = self._going[topic.name] = Alignment()
            self.topics.setdefault(topic.name, TopicCheck())
        self._kept.take(topic, side, message.payload)
        alignment.add(side, message)
        self._decide(topic, alignment)

    def _decide(self, topic: Topic, alignment: Alignment) -> None:
        check = self.topics[topic.name]
        for ours, todays in alignment.decided():
            if ours is not None and todays is not None:
                check.pairs += 1
                self._compare(topic, check, ours, todays)
            elif ours is not None:
                check.only_recorded += 1
                _keep(check, Divergence(ours.publish_time_ns / 1e9, topic.name, "", "a message", "none"))
            elif todays is not None and not (
                self.broken_off and todays.publish_time_ns > self._newest_ns.get(topic.name, -1)
            ):
                check.only_today += 1
                _keep(check, Divergence(todays.publish_time_ns / 1e9, topic.name, "", "no message", "one"))

    def _compare(self, topic: Topic, check: TopicCheck, ours: Recorded, todays: Recorded) -> None:
        if topic.name in _LATE and ours.log_time_ns != todays.log_time_ns:
            check.different += 1
            then_s, now_s = ours.log_time_ns / 1e9, todays.log_time_ns / 1e9
            late = (f"{then_s:.2f}", f"{now_s:.2f}", "s")
            _keep(check, Divergence(min(then_s, now_s), topic.name, "arrival", *late))
            return
        if ours.payload == todays.payload and ours.kind == todays.kind:
            return
        change = schema_change(ours.kind, todays.kind, _SIDES)
        if change.notes:
            self.schemas[topic.name] = change.notes
        beyond = [item for item in _unequal(ours, todays, change) if self.exact or not item.size <= topic.tolerance]
        if not beyond:
            return
        check.different += 1
        worst = max(beyond, key=lambda item: item.size)
        if math.isfinite(worst.size) and worst.size > check.largest:
            check.largest, check.largest_field, check.unit = worst.size, worst.field, worst.unit
        time_s = ours.publish_time_ns / 1e9
        if check.first is None or time_s < check.first.time_s:
            check.first = Divergence(time_s, topic.name, worst.field, worst.left, worst.right, worst.unit)


def _keep(check: TopicCheck, found: Divergence) -> None:
    if check.first is None or found.time_s < check.first.time_s:
        check.first = found


def _unequal(ours: Recorded, todays: Recorded, change: SchemaChange) -> Iterator[Unequal]:
    for note in change.notes:
        yield Unequal("schema", note, "", math.inf)
    for item in unequal_fields(ours, todays, change):
        if item.field != _HASH:
            yield item


def stamp_ns(payload: bytes) -> int:
    """Return the sim time in a payload that begins with a stamp; at least 0."""
    seconds, nanoseconds = _STAMP.unpack_from(payload)
    return int(max(seconds * 1_000_000_000 + nanoseconds, 0))


def _stamps_ns(payloads: Payloads) -> NDArray[np.int64]:
    """Return (n,) the sim times in payloads that begin with a stamp; at least 0."""
    heads = b"".join([payload[_STAMP.size - 8 : _STAMP.size] for payload in payloads.each()])
    stamps = np.frombuffer(heads, np.dtype([("sec", "<i4"), ("nanosec", "<u4")]))
    found: NDArray[np.int64] = stamps["sec"].astype(np.int64) * 1_000_000_000 + stamps["nanosec"]
    return found.clip(min=0)
