"""Where the robot is in its traversal, kept on disk from tick to tick, so that a killed process can be told to go on.

A small file mapped into memory: writing is a copy of some bytes, and what was written survives the process. Two slots
are written in turn and carry a checksum, so that a process killed in the middle of writing leaves the tick before.
"""

from __future__ import annotations

import hashlib
import math
import mmap
import struct
import zlib
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from schemas.cdr import encode
from schemas.messages import Trajectory
from services.robot_sim.frames import Checkpoint

_RECORD: Final = struct.Struct("<Q16siddQI")
"""Count, trajectory, leg, arc length, owed from (nan: none), tick, checksum."""
_SLOT: Final = 64
_SIZE: Final = 2 * _SLOT


def digest(trajectory: Trajectory) -> bytes:
    """What tells one trajectory from another: 16 bytes."""
    return hashlib.blake2b(encode(trajectory), digest_size=16).digest()


class Journal:
    """The journal of one robot.

    Raises:
        OSError: The file cannot be made or mapped.
    """

    def __init__(self, path: Path) -> None:
        """Open the journal at `path`, or begin one."""
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = path.open("a+b")
        if self._file.seek(0, 2) < _SIZE:
            self._file.truncate(_SIZE)
            self._file.flush()
        self._map = mmap.mmap(self._file.fileno(), _SIZE)
        newest = max((self._read(0), self._read(1)), key=lambda record: record[0])
        self._count, self._trajectory, self._checkpoint = newest

    def __enter__(self) -> Self:
        """Use as a context."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Unmap the file; what it says stays."""
        self._map.close()
        self._file.close()

    def unfinished(self, trajectory: Trajectory) -> Checkpoint | None:
        """From where this trajectory can go on; None if it was not under way when the journal ended."""
        return self._checkpoint if self._trajectory == digest(trajectory) else None

    def write(self, trajectory: bytes, checkpoint: Checkpoint | None) -> None:
        """Note where the trajectory of this digest is; None: it is over. Costs next to nothing if nothing changed."""
        if checkpoint == self._checkpoint and trajectory == self._trajectory:
            return
        self._count += 1
        self._trajectory, self._checkpoint = trajectory, checkpoint
        leg, arc_length_m, owed_from_m, tick = checkpoint if checkpoint is not None else (-1, 0.0, None, 0)
        owed = math.nan if owed_from_m is None else owed_from_m
        record = _RECORD.pack(self._count, trajectory, leg, arc_length_m, owed, tick, 0)[:-4]
        start = self._count % 2 * _SLOT
        self._map[start : start + _RECORD.size] = record + struct.pack("<I", zlib.crc32(record))

    def _read(self, slot: int) -> tuple[int, bytes, Checkpoint | None]:
        raw = self._map[slot * _SLOT : slot * _SLOT + _RECORD.size]
        count, trajectory, leg, arc_length_m, owed, tick, check = _RECORD.unpack(raw)
        if count == 0 or check != zlib.crc32(raw[:-4]):
            return 0, b"", None
        if leg < 0:
            return count, trajectory, None
        return count, trajectory, Checkpoint(leg, arc_length_m, None if math.isnan(owed) else owed, tick)
