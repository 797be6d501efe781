"""Formats of logs that can be read, and detection of a file's format."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Final, Protocol

from touchline.recordings.logs.clock_sections import of_one_clock
from touchline.recordings.logs.log_table import LogContent, LogError, LogStream
from touchline.schemas.plugins import Registry

_SNIFFED_BYTES = 4096
_PACKED: Final = {
    b"\x1f\x8b": "gzip",
    b"PK\x03\x04": "zip",
    b"BZh": "bzip2",
    b"\xfd7zXZ": "xz",
    b"\x28\xb5\x2f\xfd": "zstd",
    b"\x04\x22\x4d\x18": "lz4",
    b"7z\xbc\xaf": "7z",
}
"""Compression by the beginning of a file."""


class LogReader(Protocol):
    """Reader of one log; made with its path, it raises `LogError` if it cannot be read."""

    def streams(self) -> list[LogStream]:
        """Return the streams of the log."""

    def read(self, streams: Collection[str]) -> LogContent:
        """Return the tables of these streams, as far as the log has them.

        Raises:
            LogError: It cannot be read at all; damage is skipped and reported in the content's problems.
        """


class LogFormat(Protocol):
    """Class of the readers of one format."""

    def __call__(self, path: Path) -> LogReader:
        """Create a reader of the log at a path."""

    def recognises(self, path: Path, begin: bytes) -> bool:
        """Return whether the file with this beginning (`begin` is empty for a folder) has this format."""


LOG_FORMATS: Final[Registry[LogFormat]] = Registry("log format")
"""In the order in which they are tried."""
_HERE = "touchline.recordings.logs"
LOG_FORMATS.register("rosbag", "ROS 1 bags, ROS 2 bags and their folders, MCAP", f"{_HERE}.rosbag_log:RosbagLog")
LOG_FORMATS.register("rtklib", "solutions of RTKLIB (.pos)", f"{_HERE}.rtklib_log:RtklibLog")
LOG_FORMATS.register("gpx", "tracks of GPX", f"{_HERE}.gpx_log:GpxLog")
LOG_FORMATS.register("csv", "tables with a line of column names", f"{_HERE}.csv_log:CsvLog")
LOG_FORMATS.register("receiver", "NMEA, UBX and both in one stream", f"{_HERE}.receiver_log:ReceiverLog")


def open_log(path: Path) -> LogReader:
    """Return a reader of the log at `path`.

    Raises:
        LogError: It cannot be read, or has no known format.
    """
    try:
        begin = b""
        if not path.is_dir():
            if not path.is_file():
                raise LogError(f"{path}: cannot be read (no such file); give the path of a log")
            with path.open("rb") as file:
                begin = file.read(_SNIFFED_BYTES)
            if not begin:
                raise LogError(f"{path}: is empty; give a log that holds something")
        elif not any(path.iterdir()):
            raise LogError(f"{path}: is an empty folder; give a log")
        if begin.startswith(b"version https://git-lfs"):
            raise LogError(f"{path}: is a Git LFS pointer and not the log; `git lfs pull` gets that")
        for magic, what in _PACKED.items():
            if begin.startswith(magic):
                raise LogError(f"{path}: is packed ({what}); unpack it, and give what was in it")
        for name in LOG_FORMATS.names():
            kind = LOG_FORMATS.find(name)
            if kind.recognises(path, begin):
                return kind(path)
    except (OSError, ValueError) as error:  # ValueError: a path with a null byte
        reason = error.strerror if isinstance(error, OSError) else error
        raise LogError(f"{path}: cannot be read ({reason}); give the path of a log") from error
    known = "; ".join(LOG_FORMATS.summaries().values())
    raise LogError(f"{path}: is of no known format; there are {known}")


def read_logs(paths: Sequence[Path], streams: Collection[str] | None = None) -> tuple[list[LogStream], LogContent]:
    """Read several files of one drive: their streams, and the tables of the requested ones.

    Args:
        paths: The files.
        streams: Names of streams to read, cut to the longest section in which no clock was set; None: all, uncut.

    Raises:
        LogError: One of them cannot be read, or two have a stream of the same name.
    """
    listed: list[LogStream] = []
    content = LogContent()
    for path in paths:
        reader = open_log(path)
        held = reader.streams()
        if twice := {stream.name for stream in listed} & {stream.name for stream in held}:
            raise LogError(f"{path}: has the stream {min(twice)} as another file has; import them one by one")
        listed += held
        names = [stream.name for stream in held if streams is None or stream.name in streams]
        found = reader.read(names) if names else LogContent()
        if streams is not None:
            found = of_one_clock(found)
        content.tables.update(found.tables)
        content.problems += found.problems
    return listed, content
