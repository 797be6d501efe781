"""Audit log: who ordered what, when, and the answer, as lines of JSON, each with the hash of the line before.

A thread writes the lines, so a slow or full disk never holds up the process that answers the order.
"""

import errno
import fcntl
import logging
import os
import threading
from collections.abc import Iterator, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from enum import StrEnum
from itertools import count
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, Final, NamedTuple

from touchline.security.audit_files import KEPT_FILES, last_line, log_name, older, with_hash
from touchline.security.private_file import open_private

_LOGGER = logging.getLogger(__name__)
_LARGEST_FILE_BYTES: Final = 4 * 1024 * 1024
_MOST_WAITING: Final = 1000
_MOST_AT_ONCE: Final = 256
_LONGEST: Final = 1000
"""Characters of a name or text that are kept."""
_CLOSE_S: Final = 2.0
_APPENDING: Final = os.O_RDWR | os.O_APPEND


class OrderAnswer(StrEnum):
    """Answer to an order."""

    ACCEPTED = "accepted"
    REFUSED = "refused"
    ERROR = "error"


class _Note(NamedTuple):
    time: datetime
    identity: str
    order: str
    answer: OrderAnswer
    text: str


class AuditLog:
    """Audit log of one robot's orders in one process.

    Nothing here raises an error or waits for the disk: orders that cannot be written are counted, which is logged once
    and noted in the next line that can be.

    Args:
        folder: Folder of all audit logs; made with mode 700 if it is not there.
        node: Name of the process on the bus.
        namespace: Namespace of the robot; empty for a process without one.
    """

    def __init__(self, folder: Path, node: str, namespace: str) -> None:
        self._origin = {"node": node, "robot": namespace}
        self._file = _LogFile(folder, log_name(node, namespace))
        self._waiting: SimpleQueue[_Note | None] = SimpleQueue()
        self._lock = threading.Lock()
        self._lost = 0
        self._failing = False
        self._writer = threading.Thread(target=self._write_all, name=f"audit log {node}", daemon=True)
        self._writer.start()

    def note(self, identity: str, order: str, answer: OrderAnswer, text: str = "") -> None:
        """Add an order.

        Args:
            identity: Name of who gave it.
            order: Name of the service.
            answer: The answer.
            text: Text of the answer, such as the reason of a refusal.
        """
        if self._waiting.qsize() < _MOST_WAITING:
            self._waiting.put(_Note(datetime.now(UTC), identity, order, answer, text))
        else:
            with self._lock:
                self._lost += 1

    def close(self) -> None:
        """Write what waits, for at most two seconds."""
        self._waiting.put(None)
        self._writer.join(_CLOSE_S)

    def _write_all(self) -> None:
        going = True
        while going:
            notes = [self._waiting.get()]
            with suppress(Empty):
                while len(notes) < _MOST_AT_ONCE:
                    notes.append(self._waiting.get_nowait())
            going = None not in notes
            self._write([note for note in notes if note is not None])
        self._file.close()

    def _write(self, notes: Sequence[_Note]) -> None:
        if not notes:
            return
        with self._lock:
            lost, self._lost = self._lost, 0
        try:
            self._file.append(self._fields(notes, lost))
        except OSError as error:
            with self._lock:
                self._lost += lost + len(notes)
            if not self._failing:
                _LOGGER.warning(
                    "the audit log %s cannot be written: %s; orders are carried out without", self._file.path, error
                )
            self._failing = True
        else:
            self._failing = False

    def _fields(self, notes: Sequence[_Note], lost: int) -> Iterator[dict[str, Any]]:
        for number, note in enumerate(notes):
            yield {
                "time": note.time.isoformat(timespec="milliseconds"),
                **self._origin,
                "identity": note.identity[:_LONGEST],
                "order": note.order[:_LONGEST],
                "answer": note.answer,
                "text": note.text[:_LONGEST],
                **({"lost_before": lost} if lost and not number else {}),
            }


class _LogFile:
    """Files of an audit log: the present one and, as it grows, older ones beside it.

    Attributes:
        path: The present one, once it is open.
    """

    def __init__(self, folder: Path, name: str) -> None:
        self.path = folder / name
        self._name = name
        self._lock: int | None = None
        self._file: int | None = None
        self._number = 0
        self._hash = ""

    def append(self, entries: Iterator[dict[str, Any]]) -> None:
        """Append entries, all or none.

        Raises:
            OSError: They cannot be written.
        """
        if self._lock is None:
            self._take()
        lines, number, before = [], self._number, self._hash
        for fields in entries:
            number += 1
            line, before = with_hash({"number": number, **fields, "before": before})
            lines.append(line)
        data = b"".join(lines)
        file = self._opened(len(data))
        size = os.fstat(file).st_size
        try:
            if os.write(file, data) < len(data):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            os.fdatasync(file)
        except OSError:
            os.ftruncate(file, size)
            raise
        self._number, self._hash = number, before

    def close(self) -> None:
        """Close the files."""
        for each in (self._file, self._lock):
            if each is not None:
                os.close(each)
        self._file = self._lock = None

    def _take(self) -> None:
        """Take the first name that no other process of the same name has, and continue its log.

        Raises:
            OSError: The folder cannot be written.
        """
        folder = self.path.parent
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        for copy in count(1):
            self.path = folder / (self._name if copy == 1 else f"{self._name}+{copy}")
            lock = open_private(self.path.with_name(f".{self.path.name}.lock"), os.O_RDWR)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                os.close(lock)
            else:
                self._lock = lock
                break
        self._number, self._hash = last_line(self.path)

    def _opened(self, more_bytes: int) -> int:
        """Return the present file, with room for more."""
        if self._file is not None and not self._in_place(self._file):
            os.close(self._file)
            self._file = None
        if self._file is None:
            self._file = open_private(self.path, _APPENDING)
            size = os.fstat(self._file).st_size
            if size and os.pread(self._file, 1, size - 1) != b"\n":  # cut off by a power cut
                os.write(self._file, b"\n")
        if os.fstat(self._file).st_size + more_bytes > _LARGEST_FILE_BYTES:
            for age in reversed(range(KEPT_FILES - 1)):
                with suppress(FileNotFoundError):
                    older(self.path, age).replace(older(self.path, age + 1))
            os.close(self._file)
            self._file = None
            self._file = open_private(self.path, _APPENDING)
        return self._file

    def _in_place(self, file: int) -> bool:
        """Return whether the open file still has its name: nobody has moved or removed it."""
        try:
            return os.path.samestat(os.fstat(file), self.path.lstat())
        except FileNotFoundError:
            return False
