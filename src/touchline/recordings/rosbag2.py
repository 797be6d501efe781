"""Reader of rosbag2 recordings: folders with metadata.yaml, and SQLite files."""

import re
import sqlite3
from collections.abc import Collection, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

from touchline.recordings.recorded import NO_END, Loss, Recorded, RecordingKind, Summary
from touchline.recordings.recording_file import RecordingError
from touchline.recordings.sqlite_limits import bytes_of, open_limited, plain_tables

METADATA = "metadata.yaml"
SQLITE_MAGIC = b"SQLite format 3\0"
_ENDINGS = (".mcap", ".db3")
_LARGEST_METADATA_BYTES = 4 * 1024 * 1024
_MESSAGES = "SELECT topic_id, timestamp, data FROM messages ORDER BY rowid"
_CIRCLES = "it gives more than a file of its size can hold; give a bag as ros2 bag wrote it"


def bag_files(folder: Path) -> tuple[list[Path], list[Path]]:
    """Return the files of a rosbag2 folder in order, and those that it names but lacks.

    Without ``metadata.yaml``, as a killed recorder leaves it, they are in the order of their numbers.

    Raises:
        RecordingError: It has no recording, or one that is compressed as a whole.
    """
    listed = _listed(folder / METADATA)
    try:
        found = sorted((path for path in folder.iterdir() if path.suffix in _ENDINGS), key=_in_order)
        packed = sorted(path.name for path in folder.iterdir() if path.suffixes[-2:-1] in ([".mcap"], [".db3"]))
    except OSError as error:
        raise RecordingError(f"{folder}: cannot read the recording: {error.strerror}") from error
    if packed:
        raise RecordingError(f"{folder}: {packed[0]} is compressed as a whole; unpack it with `ros2 bag convert`")
    if listed is None:
        if not found:
            raise RecordingError(f"{folder}: is a folder without a recording: no {METADATA}, .mcap or .db3 in it")
        return found, []
    paths = [folder / Path(name).name for name in listed]
    missing = [path for path in paths if path not in found]
    if len(missing) == len(paths):
        raise RecordingError(f"{folder}: {METADATA} names {len(paths)} files, and none is there")
    return [path for path in paths if path in found], missing


def _in_order(path: Path) -> tuple[list[int], str]:
    return [int(number) for number in re.findall(r"\d+", path.stem)][-1:], path.name


def _listed(metadata: Path) -> list[str] | None:
    """Return the files that ``metadata.yaml`` names; None without it.

    Raises:
        RecordingError: It cannot be read, or its messages are compressed one by one.
    """
    from ruamel.yaml import YAML

    try:
        if not metadata.is_file():
            return None
        if metadata.stat().st_size > _LARGEST_METADATA_BYTES:
            raise RecordingError(f"{metadata}: has more than {_LARGEST_METADATA_BYTES:,} bytes")
        information: Any = YAML(typ="safe").load(metadata.read_bytes())["rosbag2_bagfile_information"]
        names = list(information["relative_file_paths"])
        mode = information.get("compression_mode") or ""
        if not all(isinstance(text, str) for text in (*names, mode)):  # aliases of YAML may stand for anything
            raise ValueError("a path that is no text")
        mode = mode.lower()
    except RecordingError:
        raise
    except OSError as error:
        raise RecordingError(f"{metadata}: cannot be read: {error.strerror}") from error
    except Exception as error:  # the parser raises anything on bad text
        raise RecordingError(f"{metadata}: is not rosbag2's: it names no relative_file_paths") from error
    if mode == "message":
        raise RecordingError(f"{metadata.parent}: its messages are compressed; unpack them with `ros2 bag convert`")
    return names


class SqliteFile:
    """One SQLite file of rosbag2; unreadable parts are listed in the summary.

    Args:
        path: The file.
        summary: Filled meanwhile; it may contain other files of the same recording.

    Raises:
        RecordingError: It cannot be opened, or is none of rosbag2's.
    """

    def __init__(self, path: Path, summary: Summary) -> None:
        self._path = path
        self._summary = summary
        self._size_bytes = bytes_of(path)
        self.at_bytes = 0
        self.complete = True
        try:
            self._database = open_limited(path)
            self._define()
            (self._count,) = self._database.execute("SELECT TOTAL(1) FROM messages").fetchone()
        except (sqlite3.Error, UnicodeError, TypeError, ValueError) as error:
            raise RecordingError(f"{path}: cannot be read as a rosbag2 database: {_reason(error)}") from error

    def close(self) -> None:
        """Close the file before its end; harmless when repeated."""
        self._database.close()

    def _define(self) -> None:
        """Read the topics, and since Iron the definitions of their types."""
        has = plain_tables(self._database)
        for name in ("messages", "topics"):
            if name not in has:
                raise ValueError(f"it has no plain table {name}; give a bag as ros2 bag wrote it")
        definitions: dict[str, tuple[str, str]] = {}
        if "message_definitions" in has:
            found = self._database.execute(
                "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
            )
            definitions = {str(name): (str(encoding), str(text)) for name, encoding, text in found}
        self._kinds: dict[object, tuple[str, RecordingKind]] = {}
        for number, name, ros_type, encoding in self._database.execute(
            "SELECT id, name, type, serialization_format FROM topics"
        ):
            kind = RecordingKind(str(encoding), str(ros_type), *definitions.get(str(ros_type), ("", "")))
            self._kinds[number] = str(name), kind
            self._summary.define(str(name), kind, {})

    def messages(self, topics: Collection[str] | None) -> Iterator[Recorded]:
        """Yield the messages in recorded order, of ``topics`` only if given."""
        read, unnamed, held_bytes = 0, 0, 0
        with closing(self._database) as database:
            try:
                for number, time_ns, data in database.execute(_MESSAGES):
                    read += 1
                    self.at_bytes = self._size_bytes * read // max(int(self._count), 1)
                    known = self._kinds.get(number)
                    timed = isinstance(time_ns, int) and time_ns >= 0
                    if known is None or not timed or not isinstance(data, bytes):
                        unnamed += 1
                        continue
                    held_bytes += len(data)
                    if held_bytes > self._size_bytes:
                        raise sqlite3.DatabaseError(_CIRCLES)
                    name, kind = known
                    if topics is None or name in topics:
                        self._summary.count(name, time_ns, len(data))
                        yield Recorded(name, time_ns, time_ns, 0, data, kind)
            except (sqlite3.Error, UnicodeError) as error:
                self.complete = False
                lost = max(int(self._count) - read, 0)
                self._summary.lose(Loss(f"{_reason(error)}, after message {read:,} of {self._path.name}", lost))
                self._summary.ending = NO_END
        if unnamed:
            self._summary.lose(Loss(f"of a topic that {self._path.name} does not describe, or without a time", unnamed))


def _reason(error: Exception) -> str:
    """Return why SQLite ended; for a statement that took too long it only reports an interruption."""
    return _CIRCLES if str(error) == "interrupted" else str(error)
