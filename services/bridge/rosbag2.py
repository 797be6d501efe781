"""Reads rosbag2 recordings: folders with metadata.yaml, and SQLite files."""

import re
import sqlite3
from collections.abc import Collection, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any
from urllib.parse import quote

from touchline.services.bridge.output import RecordingError
from touchline.services.bridge.recorded import NO_END, Loss, Recorded, RecordingKind, Summary

METADATA = "metadata.yaml"
SQLITE_MAGIC = b"SQLite format 3\0"
_ENDINGS = (".mcap", ".db3")
_LARGEST_METADATA_BYTES = 16 * 1024 * 1024
_LARGEST_CELL_BYTES = 64 * 1024 * 1024
_MESSAGES = (
    "SELECT topics.name, topics.type, topics.serialization_format, messages.timestamp, messages.data "
    "FROM messages LEFT JOIN topics ON messages.topic_id = topics.id ORDER BY messages.id"
)


def bag_files(folder: Path) -> tuple[list[Path], list[Path]]:
    """The files of a rosbag2 folder in their order, and those that it names but does not have.

    Without ``metadata.yaml``, as a recorder leaves it that was killed, they are in the order of their numbers.

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
    """The files that ``metadata.yaml`` names; None if there is none.

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
        names = [str(name) for name in information["relative_file_paths"]]
        mode = str(information.get("compression_mode") or "").lower()
    except RecordingError:
        raise
    except OSError as error:
        raise RecordingError(f"{metadata}: cannot be read: {error.strerror}") from error
    except Exception as error:  # whatever the text leads the parser into
        raise RecordingError(f"{metadata}: is not rosbag2's: it names no relative_file_paths") from error
    if mode == "message":
        raise RecordingError(f"{metadata.parent}: its messages are compressed; unpack them with `ros2 bag convert`")
    return names


class SqliteFile:
    """One SQLite file of rosbag2; unreadable parts are listed in the summary.

    Args:
        path: The file.
        summary: Filled on the way; it may have something from other files of the same recording.

    Raises:
        RecordingError: It cannot be opened, or is none of rosbag2's.
    """

    def __init__(self, path: Path, summary: Summary) -> None:
        self._path = path
        self._summary = summary
        self._size_bytes = path.stat().st_size
        self.at_bytes = 0
        self.complete = True
        try:
            self._database = sqlite3.connect(f"file:{quote(str(path.absolute()))}?mode=ro", uri=True, timeout=1.0)
            self._database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _LARGEST_CELL_BYTES)
            (self._count,) = self._database.execute("SELECT COUNT(*) FROM messages").fetchone()
            self._define()
        except (sqlite3.Error, UnicodeError, TypeError, ValueError) as error:
            raise RecordingError(f"{path}: cannot be read as a rosbag2 database: {error}") from error

    def close(self) -> None:
        """Close the file before its end; harmless when repeated."""
        self._database.close()

    def _define(self) -> None:
        """Learn the topics, and since Iron the definitions of their types."""
        has = {name for (name,) in self._database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
        definitions: dict[str, tuple[str, str]] = {}
        if "message_definitions" in has:
            found = self._database.execute(
                "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
            )
            definitions = {str(name): (str(encoding), str(text)) for name, encoding, text in found}
        self._kinds: dict[str, RecordingKind] = {}
        for name, ros_type, encoding in self._database.execute("SELECT name, type, serialization_format FROM topics"):
            kind = RecordingKind(str(encoding), str(ros_type), *definitions.get(str(ros_type), ("", "")))
            self._kinds[str(name)] = kind
            self._summary.define(str(name), kind, {})

    def messages(self, topics: Collection[str] | None) -> Iterator[Recorded]:
        """The messages in the order of their recording, of ``topics`` only if given."""
        read, unnamed = 0, 0
        with closing(self._database) as database:
            try:
                for name, _, _, time_ns, data in database.execute(_MESSAGES):
                    read += 1
                    self.at_bytes = self._size_bytes * read // max(self._count, 1)
                    kind = self._kinds.get(name)
                    if kind is None or not isinstance(time_ns, int) or not isinstance(data, bytes):
                        unnamed += 1
                    elif topics is None or name in topics:
                        self._summary.count(name, time_ns, len(data))
                        yield Recorded(name, time_ns, time_ns, 0, data, kind)
            except (sqlite3.Error, UnicodeError) as error:
                self.complete = False
                self._summary.lose(Loss(f"{error}, after message {read:,} of {self._path.name}", self._count - read))
                self._summary.ending = NO_END
        if unnamed:
            self._summary.lose(Loss(f"of a topic that {self._path.name} does not describe", unnamed))
