"""Record of a traversal's paint on disk, batch by batch, for a process that comes after this one.

A file mapped into memory, as the journal's: entering a batch copies some bytes, and entered batches survive the
process. Room on the disk is reserved beforehand, since a mapped page without room kills the process. Each batch carries
a checksum over itself and all before it. The number of points is in the journal: a batch is entered before the journal
counts it, so anything beyond that count is not paint, be it torn or of an earlier traversal.
"""

from __future__ import annotations

import mmap
import os
import struct
import zlib
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.services.robot_sim.paint.projection import POINT_COLUMNS

_HEADER: Final = struct.Struct("<8s16sI")
"""Magic, digest of the trajectory, checksum."""
_MAGIC: Final = b"TLPAINT1"
_BATCH: Final = struct.Struct("<II")
"""Number of points, checksum; the points follow."""
_POINT_SIZE: Final = 8 * POINT_COLUMNS
_CHUNK: Final = 1 << 20
"""Growth of the file: four minutes of spraying or more, or twenty of rolling; reserving it takes some milliseconds."""
LARGEST: Final = 64 * _CHUNK
"""Limit of the file: four hours of spraying or more, several tanks; or a day of rolling."""

Points = NDArray[np.float64]


class PaintRecord:
    """File of one robot; it belongs to one trajectory at a time.

    Attributes:
        points: Number of points in it; the next one comes after them.
    """

    def __init__(self, path: Path) -> None:
        """Open the file, or make an empty one.

        Raises:
            OSError: Neither is possible.
        """
        self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        self._map: mmap.mmap | None = None
        self._check = self._end = self.points = 0
        size = os.fstat(self._file).st_size
        if size:
            self._map = mmap.mmap(self._file, size)

    def close(self) -> None:
        """Unmap the file; its contents remain."""
        if self._map is not None:
            self._map.close()
        os.close(self._file)

    def begin(self, trajectory: bytes) -> None:
        """Remove all paint; the next points belong to the trajectory of this digest.

        Raises:
            OSError: There is no room for it.
        """
        if self._map is not None:
            self._map.close()
            self._map = None
        os.ftruncate(self._file, 0)
        room = self._grow(_CHUNK)
        room[: _HEADER.size] = header = _header(trajectory)
        self.points, self._end, self._check = 0, _HEADER.size, zlib.crc32(header)

    def append(self, points: Points) -> None:
        """Enter points (n, POINT_COLUMNS).

        Raises:
            OSError: There is no room for them; none is entered.
        """
        raw, count = points.tobytes(), len(points)
        end = self._end + _BATCH.size + len(raw)
        room = self._map
        if room is None or end > len(room):
            room = self._grow((end // _CHUNK + 1) * _CHUNK)
        check = zlib.crc32(raw, self._check)
        room[self._end : end] = _BATCH.pack(count, check) + raw
        self._end, self._check = end, check
        self.points += count

    def read(self, trajectory: bytes, count: int) -> Points:
        """Read the first points of a trajectory; `append` continues after them.

        Args:
            trajectory: Digest of the trajectory.
            count: Number of points.

        Returns:
            (n, POINT_COLUMNS) points; fewer if the file ends before or is damaged there; none if it is of something
                else.
        """
        header, raw = _header(trajectory), self._map if self._map is not None else b""
        self.points, self._end, self._check = 0, _HEADER.size, zlib.crc32(header)
        batches: list[bytes] = []
        while raw[: _HEADER.size] == header and self.points < count and self._end + _BATCH.size <= len(raw):
            points, check = _BATCH.unpack(raw[self._end : self._end + _BATCH.size])
            end = self._end + _BATCH.size + points * _POINT_SIZE
            batch = raw[self._end + _BATCH.size : end]
            if points == 0 or end > len(raw) or zlib.crc32(batch, self._check) != check:
                break
            self.points, self._end, self._check = self.points + points, end, check
            batches.append(batch)
        return np.frombuffer(b"".join(batches)).reshape(-1, POINT_COLUMNS)

    def _grow(self, size: int) -> mmap.mmap:
        if size > LARGEST:
            raise OSError(f"it would be larger than {LARGEST >> 20} MiB")
        os.posix_fallocate(self._file, 0, size)
        if self._map is not None:
            self._map.close()
        self._map = mmap.mmap(self._file, size)
        return self._map


def _header(trajectory: bytes) -> bytes:
    start = _HEADER.pack(_MAGIC, trajectory, 0)[:-4]
    return start + struct.pack("<I", zlib.crc32(start))
