"""Reader of our and ROS 2's recordings; damaged parts are skipped and reported."""

import stat
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

import numpy as np

from touchline.recordings.latched_repeats import LatchedRepeats
from touchline.recordings.mcap_file import McapFile
from touchline.recordings.message_table import MessageTable, TableFiller, Wanted
from touchline.recordings.parts import with_followers
from touchline.recordings.recorded import FileSummary, Loss, Recorded, RecordingKind, Summary
from touchline.recordings.recording_file import RecordingError
from touchline.recordings.rosbag2 import SQLITE_MAGIC, SqliteFile, bag_files


class _File(Protocol):
    @property
    def at_bytes(self) -> int: ...

    @property
    def complete(self) -> bool: ...

    def messages(self, topics: Collection[str] | None) -> Iterator[Recorded]: ...

    def close(self) -> None: ...


class RecordingReader:
    """Reads one recording from front to back, in recorded order.

    Args:
        path: An MCAP file, which stands for its next parts, too, a SQLite file of rosbag2, or a folder of either.

    Attributes:
        summary: Filled while :meth:`messages` runs; final once it has ended.

    Raises:
        RecordingError: It cannot be opened, or is no recording.
    """

    def __init__(self, path: Path) -> None:
        try:
            mode = path.stat().st_mode
            paths, missing = bag_files(path) if stat.S_ISDIR(mode) else (with_followers(path), [])
            sizes = [each.stat().st_size for each in paths]
            self.summary = Summary(path, sum(sizes), complete=True)
            for each in missing:
                self.summary.lose(Loss(f"{each.name} is not there"))
            opened = [_opened(each, self.summary) for each in paths]
            self._files = list(zip(paths, opened, sizes, strict=True))
        except (OSError, ValueError) as error:  # ValueError: a path with a null byte
            reason = error.strerror if isinstance(error, OSError) else error
            raise RecordingError(f"{path}: cannot read the recording: {reason}") from error
        self._done_bytes = 0
        self._now: _File | None = None

    def close(self) -> None:
        """Close the recording before its end; harmless when repeated."""
        for _, file, _ in self._files:
            file.close()
        self._now, self._done_bytes = None, self.summary.size_bytes

    @property
    def fraction(self) -> float:
        """Share of the recording that has been read, 0…1."""
        at_bytes = self._done_bytes + (self._now.at_bytes if self._now is not None else 0)
        return at_bytes / self.summary.size_bytes if self.summary.size_bytes else 1.0

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Recorded]:
        """Yield the messages, of ``topics`` only if given (the summary then counts these).

        What the next part of a session repeats from the one before is left out; the summary counts what the files hold.

        Raises:
            RecordingError: It is no recording. Damage further on is skipped and reported in the summary.
        """
        repeats, in_parts = LatchedRepeats(), len(self._files) > 1
        for path, file, size_bytes in self._files:
            with self._summarised(path, file, size_bytes):
                found = file.messages(topics)
                yield from (message for message in found if not repeats.is_repeat(message)) if in_parts else found

    def tables(self, wanted: Wanted) -> list[MessageTable]:
        """Return the messages of the wanted topics as a table each; the summary counts all messages.

        Raises:
            RecordingError: As `messages`.
        """
        path, file, size_bytes = self._files[0]
        if len(self._files) == 1 and isinstance(file, McapFile):
            filler = TableFiller(wanted)
            with self._summarised(path, file, size_bytes):
                filler.fill(file, self.summary)
            return filler.tables()
        found: dict[tuple[str, RecordingKind], list[tuple[int, Recorded]]] = {}
        for place, message in enumerate(self.messages()):
            if wanted(message.topic):
                found.setdefault((message.topic, message.kind), []).append((place, message))
        return [
            MessageTable.of(message for _, message in some)._replace(place=np.array([place for place, _ in some]))
            for some in found.values()
        ]

    @contextmanager
    def _summarised(self, path: Path, file: _File, size_bytes: int) -> Iterator[None]:
        """Add what is read of a file meanwhile to the summary."""
        self._now = file
        held, lost, ending = self.summary.messages, len(self.summary.losses), self.summary.ending
        self.summary.ending = ""
        yield
        messages, losses = self.summary.messages - held, self.summary.losses[lost:]
        self.summary.files.append(FileSummary(path, size_bytes, messages, file.complete, losses))
        self.summary.complete &= file.complete
        if self.summary.ending and len(self._files) > 1:
            self.summary.ending = f"{path.name} is {self.summary.ending}"
        self.summary.ending = "; ".join(filter(None, (ending, self.summary.ending)))
        self._now, self._done_bytes = None, self._done_bytes + size_bytes


def _opened(path: Path, summary: Summary) -> _File:
    """Open the file at ``path`` by its format."""
    found = path.stat()
    if not stat.S_ISREG(found.st_mode):
        raise RecordingError(f"{path}: cannot read the recording: it is no file")
    stream = path.open("rb")
    begin = stream.read(len(SQLITE_MAGIC))
    if begin == SQLITE_MAGIC:
        stream.close()
        return SqliteFile(path, summary)
    stream.seek(0)
    return McapFile(path, stream, found.st_size, summary)


def read_summary(path: Path) -> Summary:
    """Read the whole recording at ``path`` and summarise it.

    Raises:
        RecordingError: The file cannot be opened or is no recording.
    """
    reader = RecordingReader(path)
    for _ in reader.messages():
        pass
    return reader.summary
