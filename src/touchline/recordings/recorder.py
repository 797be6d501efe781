"""Recorder of the bus to MCAP, as ROS 2's own recorder would write it.

The file has its final name from the first byte on, so that a recording cut off by kill -9 or a power cut is found where
it was requested. An existing file is never overwritten unless that is requested.
"""

import os
import stat
import struct
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cache
from importlib.metadata import version
from pathlib import Path

from mcap.writer import MCAP0_MAGIC, CompressionType, Writer

from touchline.recordings.channels import channel_metadata, kind_of, topic_path
from touchline.recordings.losses import Losses
from touchline.recordings.parts import renamed_parts, with_followers
from touchline.recordings.provenance import MADE_BY, made_by
from touchline.recordings.reader import read_summary
from touchline.recordings.recording_file import RecordingError, RecordingFile
from touchline.recordings.robot_time import RobotTime
from touchline.recordings.seal_reader import file_id
from touchline.recordings.sealing import SealedFile, Signer
from touchline.recordings.session_attachments import KEPT, SESSIONS, SessionAttachments
from touchline.recordings.viewing import Viewing, frame_prefix
from touchline.schemas.messages import Header, Time
from touchline.schemas.messages.base import Message
from touchline.schemas.topics import CLAIMED, CLOCK, DEFAULT_NAMESPACE, RECORDED, VIEWING, Topic

CHUNK_BYTES = 64 * 1024
_STAMP = struct.Struct("<iI")
_STAMP_OFFSET = 4  # behind the CDR header
_STAMP_END = _STAMP_OFFSET + _STAMP.size


class Existing(Enum):
    """Action if the file already exists."""

    RENAME = "rename"
    """Keep the older recording as ``NAME.1.mcap``, or the next free number."""
    REFUSE = "refuse"
    REPLACE = "replace"


@dataclass(frozen=True)
class RecordingReport:
    """Contents of a finished recording.

    Attributes:
        bytes: Size of the file.
        lost: Messages that were published but never reached the recorder, from gaps in the sequence numbers.
        per_topic: Messages by ROS topic name.
        rejected: Payloads that did not fit their topic or were damaged, and so are not in the file.
        problem: Why the recording is incomplete; empty if it is complete.
    """

    path: Path
    messages: int
    bytes: int
    lost: int
    per_topic: dict[str, int] = field(default_factory=dict)
    rejected: int = 0
    problem: str = ""


def joined(reports: Sequence[RecordingReport], problem: str = "") -> RecordingReport:
    """Return the report of files that follow one another, under the name of the first; ``problem`` is added."""
    if len(reports) == 1 and not problem:
        return reports[0]
    per_topic: Counter[str] = Counter()
    for report in reports:
        per_topic.update(report.per_topic)
    return RecordingReport(
        reports[0].path,
        sum(report.messages for report in reports),
        sum(report.bytes for report in reports),
        sum(report.lost for report in reports),
        dict(per_topic),
        sum(report.rejected for report in reports),
        "; ".join(filter(None, (*(report.problem for report in reports), problem))),
    )


class _Channel:
    """Recorder's state of one topic of a robot."""

    __slots__ = ("channel_id", "last_ns", "messages", "name", "robot", "stamped")

    def __init__(self, name: str, channel_id: int, stamped: bool, robot: "_Robot") -> None:
        self.name = name
        self.channel_id = channel_id
        self.stamped = stamped
        self.robot = robot
        self.messages = 0
        self.last_ns = 0


class _Robot(RobotTime):
    """Time of a robot, messages that came before any was known, and the viewers' drawing of it."""

    __slots__ = ("viewing", "waiting")

    def __init__(self, viewing: Viewing) -> None:
        super().__init__()
        self.waiting: list[tuple[_Channel, bytes, int]] = []
        self.viewing = viewing


def is_stamped(topic: Topic) -> bool:
    """Return whether the topic's messages begin with the robot's sim time (in a header, or the clock itself)."""
    return topic is not CLAIMED and _begins_with_stamp(topic.type)


@cache
def _begins_with_stamp(kind: type[Message]) -> bool:
    first = next(iter(kind.model_fields.values()), None)
    return first is not None and first.annotation in (Header, Time)


class Recorder:
    """Records messages of one or more robots into one MCAP file.

    ``publish_time`` is the sim time of the message's stamp. ``log_time`` is the time of arrival in the robot's sim
    time:
    the latest of its clock and of the stamps before and in it, so that the same run gives the same recording at any
    pace, alone and beside other robots; it never steps back, and continues where it was when the robot's clock
    restarts. Messages without a stamp take the robot's latest sim time for both (the first one to come, if none has
    come yet). Viewers' messages (`VIEWING`) are made here, with the times of their sources; they are not counted.

    Args:
        path: File to write; its folder must exist and its name end in ``.mcap``.
        namespaces: Namespaces of the robots to record.
        topics: Rows of the topic table to record.
        existing: What to do when the file exists.
        continues: The files of the same recording before this one.
        before: The recorder of the file before this one, if it was in this process: its robots' time continues here.
        signer: Identity that seals the recording, so that changes of the file show; None: no seals.

    Raises:
        RecordingError: The file cannot be created.
    """

    def __init__(
        self,
        path: Path,
        namespaces: Sequence[str] = (DEFAULT_NAMESPACE,),
        topics: Sequence[Topic] = RECORDED,
        existing: Existing = Existing.RENAME,
        continues: Sequence[Path] = (),
        before: "Recorder | None" = None,
        signer: Signer | None = None,
    ) -> None:
        make_room(path, existing)
        self.path = path
        self.signer = signer
        self._file = (
            RecordingFile(path)
            if signer is None
            else SealedFile(path, signer, file_id(continues[-1]) if continues else "")
        )
        self._problem = ""
        self._report: RecordingReport | None = None
        self._robots: dict[str, _Robot] = {
            namespace: _Robot(Viewing(frame_prefix(namespace, namespaces))) for namespace in namespaces
        }
        if before is not None:
            self._robots = before._robots
        self._span_ns: tuple[int, int] | None = None
        self._written = 0
        self._first = namespaces[0]
        self._channels: dict[tuple[str, str], _Channel] = {}
        self._drawn: dict[tuple[str, str], _Channel] = {}
        self._keepsakes = {namespace: SessionAttachments(namespace) for namespace in namespaces}
        self._losses = Losses()
        self._writer = Writer(self._file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)  # type: ignore[arg-type]
        try:
            self._writer.start("ros2", f"touchline {version('touchline')}")
            self._seal()
            self._channels = self._register(topics)
            self._drawn = self._register(VIEWING)
        except RecordingError:
            self._file.close()
            path.unlink(missing_ok=True)
            raise
        self.note(MADE_BY, made_by())
        if continues:
            part = {"part": str(len(continues) + 1), "before": ", ".join(each.name for each in continues)}
            self.note("touchline_part", part)

    def _register(self, topics: Sequence[Topic]) -> dict[tuple[str, str], _Channel]:
        schemas: dict[str, int] = {}
        channels: dict[tuple[str, str], _Channel] = {}
        for namespace, robot in self._robots.items():
            for topic in topics:
                kind, name = kind_of(topic.type), topic_path(namespace, topic)
                if kind.type not in schemas:
                    text = kind.schema.encode()
                    schemas[kind.type] = self._writer.register_schema(kind.type, kind.schema_encoding, text)
                schema, metadata = schemas[kind.type], channel_metadata(topic)
                channel_id = self._writer.register_channel(name, kind.encoding, schema, metadata)
                channels[namespace, topic.name] = _Channel(name, channel_id, is_stamped(topic), robot)
        return channels

    @property
    def messages(self) -> int:
        """Messages taken so far."""
        return sum(channel.messages for channel in self._channels.values())

    @property
    def lost(self) -> int:
        """Number of messages that never arrived."""
        return self._losses.total

    @property
    def gaps(self) -> int:
        """Number of stretches of sim time in which messages are missing."""
        return len(self._losses.episodes)

    @property
    def size_bytes(self) -> int:
        """Bytes in the file so far."""
        return self._file.tell()

    @property
    def span_s(self) -> float:
        """Log time from the earliest to the latest message in the file."""
        return (self._span_ns[1] - self._span_ns[0]) / 1e9 if self._span_ns is not None else 0.0

    @property
    def robots(self) -> tuple[str, ...]:
        """Namespaces of the robots."""
        return tuple(self._robots)

    def now_ns(self, namespace: str) -> int:
        """Return the latest sim time of a robot's clock (of any stamp, while no clock has come)."""
        return self._robots[namespace].now_ns

    @property
    def problem(self) -> str:
        """Reason why recording ended early; empty while all is well."""
        return self._problem

    def write(self, topic: str, payload: bytes, sequence: int, missed: int = 0, namespace: str = "") -> None:
        """Record one message.

        Args:
            topic: Name in the topic table.
            payload: CDR with its header.
            sequence: Sequence number of the publisher; its lower 32 bits are recorded.
            missed: Messages of the same topic that are missing before this one.
            namespace: Namespace of the robot; empty: the first one's.

        Raises:
            RecordingError: The disk is full or failed. The recording is closed as well as possible and takes nothing
                more;
                :meth:`finish` reports its contents.
            KeyError: The robot or the topic is not among those given at the start.
        """
        channel = self._channels[namespace or self._first, topic]
        robot = channel.robot
        channel.messages += 1
        if topic in KEPT:
            self._keepsakes[namespace or self._first].take(topic, payload)
        if channel.stamped and len(payload) >= _STAMP_END:
            seconds, nanoseconds = _STAMP.unpack_from(payload, _STAMP_OFFSET)
            time_ns = max(seconds * 1_000_000_000 + nanoseconds, 0)
            robot.hear(time_ns, topic == CLOCK.name)
            if not robot.known:
                robot.known = True
                self._write_waiting(robot)
        elif robot.known:
            time_ns = robot.latest_ns
        else:
            robot.waiting.append((channel, payload, sequence))
            robot.waiting += self._drawings(robot, namespace, topic, payload)
            return
        if missed:
            self._losses.add(channel.name, missed, channel.last_ns or time_ns, time_ns)
        channel.last_ns = time_ns
        self._put(channel, time_ns, payload, sequence)
        for drawn, drawing, number in self._drawings(robot, namespace, topic, payload):
            self._put(drawn, time_ns, drawing, number)

    def _drawings(
        self, robot: _Robot, namespace: str, topic: str, payload: bytes
    ) -> Iterator[tuple[_Channel, bytes, int]]:
        """Yield the viewers' messages made from a message of the robot."""
        for drawn in robot.viewing.take(topic, payload):
            channel = self._drawn[namespace or self._first, drawn.topic.name]
            channel.messages += 1
            yield channel, drawn.payload, channel.messages

    def lose(self, topic: str, missing: int, namespace: str) -> None:
        """Count messages missing at the end, which only their publisher's own count shows.

        Args:
            topic: Name in the topic table.
            missing: Number of messages.
            namespace: Namespace of the robot.
        """
        channel = self._channels[namespace or self._first, topic]
        self._losses.add(channel.name, missing, channel.robot.now_ns, channel.robot.now_ns)

    def _put(self, channel: _Channel, time_ns: int, payload: bytes, sequence: int) -> None:
        if self._problem:
            raise RecordingError(self._problem)
        try:
            log_ns = channel.robot.log_ns
            first_ns, last_ns = self._span_ns or (log_ns, log_ns)
            self._span_ns = min(first_ns, log_ns), max(last_ns, log_ns)
            self._writer.add_message(channel.channel_id, log_ns, payload, time_ns, sequence & 0xFFFFFFFF)
            self._written += 1
        except RecordingError as error:
            self._fail(error)
            raise

    def _write_waiting(self, robot: "_Robot") -> None:
        waiting, robot.waiting = robot.waiting, []
        for channel, payload, sequence in waiting:
            self._put(channel, robot.latest_ns, payload, sequence)

    def note(self, name: str, values: Mapping[str, str]) -> None:
        """Add a metadata record. A failure becomes the recording's `problem`."""
        if self._problem:
            return
        try:
            self._writer.add_metadata(name, dict(values))
        except RecordingError as error:
            self._fail(error)

    def flush(self) -> None:
        """End the chunk in progress, so that all taken until now survives the process, and seal it.

        Raises:
            RecordingError: As :meth:`write`.
        """
        if self._problem:
            raise RecordingError(self._problem)
        try:
            self._writer.flush()  # type: ignore[no-untyped-call]
            self._seal()
        except RecordingError as error:
            self._fail(error)
            raise

    def _seal(self) -> None:
        if isinstance(self._file, SealedFile):
            self._file.seal(self._writer, self._written, self._latest_ns)

    @property
    def _latest_ns(self) -> int:
        """Latest log time in the file."""
        return self._span_ns[1] if self._span_ns is not None else 0

    def _fail(self, error: RecordingError) -> None:
        ended = self._file.close_short()
        self._problem = f"{error}; {'the recording ends before it' if ended else 'the recording is broken off there'}"

    def finish(
        self,
        rejected: Mapping[tuple[str, str], int] | None = None,
        unasked: Sequence[str] = (),
        *,
        goes_on: bool = False,
    ) -> RecordingReport:
        """Complete the file with its index and close it; a repeated call returns the same report.

        After a failed write nothing is raised: the report names the failure and the file's contents.

        Args:
            rejected: By robot and name in the topic table, payloads that were kept from the recording.
            unasked: Publishers that could not be asked for their last messages, so that losses are unknown.
            goes_on: Whether the recording goes on in another file.
        """
        if self._report is None:
            self._report = self._finish(rejected or {}, ", ".join(unasked), goes_on)
        return self._report

    def _finish(self, rejected: Mapping[tuple[str, str], int], unasked: str, goes_on: bool) -> RecordingReport:
        counts = {channel.name: channel.messages for channel in self._channels.values()}
        if not self._problem:
            try:
                for robot in self._robots.values():
                    self._write_waiting(robot)
                self._writer.flush()  # type: ignore[no-untyped-call]
                self._keep()
                for name, values in self._losses.metadata():
                    self._writer.add_metadata(name, values)
                if rejected:
                    self._writer.add_metadata("touchline_rejected", self._rejected_metadata(rejected))
                if unasked:
                    self._writer.add_metadata("touchline_unasked", {"publishers": unasked})
                if isinstance(self._file, SealedFile):
                    self._file.finish(self._writer, self._written, self._latest_ns, goes_on=goes_on)
                else:
                    self._writer.finish()  # type: ignore[no-untyped-call]
                self._file.close()
            except RecordingError as error:
                if not self._problem:
                    self._fail(error)
        if self._problem:
            held = read_summary(self.path)
            counts = {name: held.topics[name].messages if name in held.topics else 0 for name in counts}
        size = self.path.stat().st_size
        refused = sum(rejected.values())
        unknown = f"its end may be missing: {unasked} could not be asked what was sent last" if unasked else ""
        problem = self._problem or unknown
        return RecordingReport(self.path, sum(counts.values()), size, self.lost, counts, refused, problem)

    def _keep(self) -> None:
        """Write the causes of the sessions, and their hashes."""
        hashes = {name: kept.session_hashes for name, kept in self._keepsakes.items() if kept.session_hashes}
        if hashes:
            self._writer.add_metadata(SESSIONS, hashes)
        for kept in self._keepsakes.values():
            for each in kept.attachments():
                self._writer.add_attachment(0, 0, each.name, each.media_type, each.data)

    def _rejected_metadata(self, rejected: Mapping[tuple[str, str], int]) -> dict[str, str]:
        """Return rejected payloads in all and by topic, as metadata."""
        per_topic = {self._channels[place].name: str(count) for place, count in rejected.items()}
        return {"total": str(sum(rejected.values())), **per_topic}


def make_room(path: Path, existing: Existing) -> None:
    """Move an older recording and its next parts away from ``path``; nothing else is touched.

    Raises:
        RecordingError: No recording can be written there.
    """
    if path.suffix != ".mcap":
        raise RecordingError(f"{path}: a recording's name ends in .mcap")
    try:
        if not path.parent.is_dir():
            raise RecordingError(f"{path}: its folder does not exist")
        parts = with_followers(path)
        there = [each for each in parts if os.path.lexists(each)]
        if not there:
            return
        if existing is Existing.REFUSE:
            raise RecordingError(f"{there[0]}: is there already; choose another name")
        for each in there:
            if not _is_recording(each):
                raise RecordingError(f"{each}: is there already and is no recording; choose another name")
        if existing is Existing.REPLACE:
            for each in there:
                each.unlink()
            return
        for before, after in zip(parts, renamed_parts(parts, _free_name(path)), strict=True):
            if before in there:
                before.rename(after)
    except (OSError, ValueError) as error:  # ValueError: a path with a null byte
        reason = error.strerror if isinstance(error, OSError) else error
        raise RecordingError(f"{path}: cannot be recorded to: {reason}") from error


def _is_recording(path: Path) -> bool:
    """Return whether it is a file, not a link to one, that begins as every MCAP file does."""
    if not stat.S_ISREG(path.lstat().st_mode):
        return False
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        return os.read(descriptor, len(MCAP0_MAGIC)) == MCAP0_MAGIC
    finally:
        os.close(descriptor)


def _free_name(path: Path) -> Path:
    number = 1
    while any(os.path.lexists(each) for each in with_followers(path.with_name(f"{path.stem}.{number}.mcap"))):
        number += 1
    return path.with_name(f"{path.stem}.{number}.mcap")
