"""Copy of everything readable in a recording to a sound file with index."""

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

from mcap.writer import CompressionType, Writer

from touchline.recordings.attachments import attached_data
from touchline.recordings.code_identity import own_version
from touchline.recordings.reader import RecordingReader
from touchline.recordings.recorded import SCHEMA_ERRORS, Damage, Loss, Recorded, RecordingKind, Summary
from touchline.recordings.recorder import CHUNK_BYTES, Existing, make_room
from touchline.recordings.recording_file import RecordingFile


@dataclass
class Salvaged:
    """Result of a salvage.

    Attributes:
        path: The new file.
        messages, attachments: How many are in it.
        losses: What is not.
        ending: Why reading ended early, and where; empty if it did not. By itself it is no loss.
    """

    path: Path
    messages: int = 0
    attachments: int = 0
    losses: list[Loss] = field(default_factory=list)
    ending: str = ""

    @property
    def lost(self) -> int | None:
        """Number of lost messages; None if unknown."""
        counts = [loss.messages for loss in self.losses]
        known = [count for count in counts if count is not None]
        return sum(known) if len(known) == len(counts) else None


def salvage(source: Path, target: Path) -> Salvaged:
    """Copy the readable part of the recording ``source`` to the new file ``target``.

    Raises:
        RecordingError: The source is no recording, or the target exists or cannot be written; it is then removed.
    """
    return copied(source, target, CopyPlan("touchline_salvaged", lambda message: iter((message,))))


@dataclass(frozen=True)
class CopyPlan:
    """Changes to a recording as it is copied.

    Attributes:
        note: Name of the metadata about origin and losses.
        change: Replaces a message by none, one or several.
        added: Metadata of the channels of topics that the recording does not have itself.
    """

    note: str
    change: Callable[[Recorded], Iterator[Recorded]]
    added: Mapping[str, dict[str, str]] = field(default_factory=dict)


def copied(source: Path, target: Path, plan: CopyPlan) -> Salvaged:
    """Copy the readable part of a recording to a new file, changed as planned.

    Raises:
        RecordingError: The source is no recording, or the target exists or cannot be written; it is then removed.
    """
    make_room(target, Existing.REFUSE)
    with closing(RecordingReader(source)) as reader:
        return _copied(reader, target, plan)


def _copied(reader: RecordingReader, target: Path, plan: CopyPlan) -> Salvaged:
    file = RecordingFile(target)
    try:
        copy = _Copy(file, reader.summary, plan)
        for message in reader.messages():
            for each in plan.change(message):
                copy.add(each)
        found = copy.finish(target)
    except BaseException:  # an interruption, too: half a copy is worth nothing
        file.close()
        target.unlink()
        raise
    file.close()
    return found


class _Copy:
    """New file being written; its header is the source's, which is known with the first message."""

    def __init__(self, file: RecordingFile, summary: Summary, plan: CopyPlan) -> None:
        self._plan = plan
        self._writer = Writer(file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)  # type: ignore[arg-type]
        self._summary = summary
        self._begun = False
        self._schemas: dict[tuple[str, str, str], int] = {}
        self._channels: dict[tuple[str, RecordingKind], int] = {}
        self._messages = 0
        self._last_ns = 0
        self._waiting: Recorded | None = None

    def add(self, message: Recorded) -> None:
        """Copy a message; the last one is held until `finish`."""
        if self._waiting is not None:
            self._write(self._waiting)
        self._waiting = message

    def _write(self, message: Recorded) -> None:
        channel = self._channels.get((message.topic, message.kind))
        if channel is None:
            channel = self._channel(message.topic, message.kind)
        log_ns, publish_ns = message.log_time_ns, message.publish_time_ns
        self._writer.add_message(channel, log_ns, message.payload, publish_ns, message.sequence)
        self._messages += 1
        self._last_ns = max(self._last_ns, log_ns)

    def finish(self, path: Path) -> Salvaged:
        """Copy attachments and metadata, and complete the file."""
        held = self._summary
        if self._waiting is not None:
            # Channels without messages are written before the last message: a chunk is not written for channels alone,
            # and they would be in the summary and not in the data.
            for topic, described in held.topics.items():
                if (topic, described.kind) not in self._channels:
                    self._channel(topic, described.kind)
            self._write(self._waiting)
        self._begin()
        self._writer.flush()  # type: ignore[no-untyped-call]
        found = Salvaged(path, self._messages, 0, list(held.losses), held.ending)
        if held.ending:
            found.ending = f"{held.ending}; the last message is of {self._last_ns / 1e9:.3f} s"
        if held.cut_bytes:
            found.losses.append(
                Loss(f"the last {held.cut_bytes:,} bytes are an incomplete record", from_ns=self._last_ns)
            )
        for attached in held.attachments:
            try:
                data = attached_data(attached)
            except (Damage, OSError) as error:
                found.losses.append(Loss(f"{error}, at byte {attached.at_byte:,} of {attached.file.name}", 0))
                continue
            times = attached.create_time_ns, attached.log_time_ns
            self._writer.add_attachment(*times, attached.name, attached.media_type, data)
            found.attachments += 1
        for name, values in held.metadata.items():
            self._writer.add_metadata(name, values)
        account = _account(held.path, found)
        self._writer.add_metadata(self._plan.note, account)
        if not found.attachments:  # else the writer would refer to an empty index, which is no valid MCAP
            self._writer.add_attachment(
                0, 0, f"{self._plan.note}.json", "application/json", json.dumps(account).encode()
            )
        self._writer.finish()  # type: ignore[no-untyped-call]
        return found

    def _begin(self) -> None:
        if not self._begun:
            self._begun = True
            self._writer.start(self._summary.profile, f"touchline {own_version()}")

    def _channel(self, topic: str, kind: RecordingKind) -> int:
        self._begin()
        schema = kind.type, kind.schema_encoding, kind.schema
        if schema not in self._schemas:
            text = kind.schema.encode(errors=SCHEMA_ERRORS)
            self._schemas[schema] = self._writer.register_schema(*schema[:2], text) if any(schema) else 0
        own = self._summary.topics.get(topic)
        metadata = own.metadata if own is not None else self._plan.added[topic]
        channel = self._writer.register_channel(topic, kind.encoding, self._schemas[schema], metadata)
        self._channels[topic, kind] = channel
        return channel


def _account(source: Path, found: Salvaged) -> dict[str, str]:
    """Return the metadata of the new file."""
    lost = "unknown" if found.lost is None else str(found.lost)
    losses = {f"loss_{number}": str(loss) for number, loss in enumerate(found.losses, 1)}
    return {"from": source.name, "lost": lost, **losses, **({"ending": found.ending} if found.ending else {})}
