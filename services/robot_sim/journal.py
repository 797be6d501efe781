"""Journal of the robot's traversal, kept on disk from tick to tick, so that a job can continue after the process died.

A small file mapped into memory: writing copies some bytes, and written bytes survive the process. Two slots are written
in turn and carry a checksum, so that a process killed in the middle of writing leaves its previous entry. The paint is
in a file beside it, `paint/record.py`; a slot holds the number of its points. The setup is there, too, the robot and
the world that the traversal began in: it can only continue in the same. And so is the job itself, plan and template, so
that a process with neither can continue it.

An emergency stop has a place of its own after the slots, and is latched there until a reset.
"""

from __future__ import annotations

import fcntl
import hashlib
import math
import mmap
import os
import struct
import zlib
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Final, NamedTuple, Self

from touchline.onboard.interface import LEARNED_FIGURES, Checkpoint
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import CommandRefused, PayloadError
from touchline.schemas.messages import LoadRequest, Trajectory
from touchline.services.robot_sim.paint.ledger import PaintLedger
from touchline.services.robot_sim.paint.record import PaintRecord
from touchline.services.robot_sim.recovery_state import EarlierWork, Totals
from touchline.services.robot_sim.setup_text import SetupText

_RECORD: Final = struct.Struct("<Q16s16siddQdI10d4d3dQ")
"""Number, trajectory, setup, the checkpoint (leg −1: over; owed from and learned nan: nothing), the totals."""
_CHECK: Final = struct.Struct("<I")
_USED: Final = _RECORD.size + _CHECK.size
_VERSION: Final = 5
"""Start value of the checksum: a record of another layout is invalid."""
_SLOT: Final = 256
_LATCH_AT: Final = 2 * _SLOT
_SIZE: Final = 3 * _SLOT
_LATCH: Final = struct.Struct("<8s200s")
"""A mark and the reason; all zero, as in a journal from before there was a latch: not latched."""
_LATCHED: Final = b"ESTOPPED"
_OVER: Final = Checkpoint(-1, 0.0, None)
_NOTHING: Final = Totals((0.0,) * 4, (0.0,) * 3, 0)


def digest(trajectory: Trajectory) -> bytes:
    """Compute the digest of a trajectory, 16 bytes."""
    return hashlib.blake2b(encode(trajectory), digest_size=16).digest()


class _Entry(NamedTuple):
    number: int  # counts up; 0 is none
    trajectory: bytes
    setup: bytes
    checkpoint: Checkpoint
    totals: Totals


_NO_ENTRY: Final = _Entry(0, b"", b"", _OVER, _NOTHING)


class Journal:
    """Journal of one robot. An unusable file does not stop the robot: it drives without a journal.

    Attributes:
        problem: Reason why nothing, or not all, is kept; "" if all is well.
    """

    def __init__(self, path: Path) -> None:
        """Open the journal at `path`, or begin one; a file of another kind is overwritten in time."""
        self.problem = ""
        self._file = -1
        self._map: mmap.mmap | None = None
        self._paint: PaintRecord | None = None
        self._keeps_paint = False
        self._number, self._trajectory, self._setup = 0, b"", b""
        self._setup_path, self._job_path = path.with_suffix(".setup"), path.with_suffix(".job")
        try:
            self._open(path)
        except BlockingIOError:
            self.problem = f"another robot keeps its journal in {path}"
        except OSError as error:
            self.problem = f"the journal {path} cannot be kept: {error.strerror or error}"
        if self.problem:
            self._close()

    def _open(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)  # released when the process dies
        os.posix_fallocate(self._file, 0, _SIZE)  # a mapped page without room on the disk would kill the process
        self._map = mmap.mmap(self._file, _SIZE)
        newest = self._newest()
        self._number, self._trajectory, self._setup = newest.number, newest.trajectory, newest.setup
        self._paint = PaintRecord(path.with_suffix(".paint"))

    def __enter__(self) -> Self:
        """Use as a context."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Unmap the files; their contents remain."""
        self._close()

    def _close(self) -> None:
        if self._paint is not None:
            self._paint.close()
        if self._map is not None:
            self._map.close()
        if self._file >= 0:
            os.close(self._file)
        self._paint, self._map, self._file = None, None, -1

    def unfinished(self, trajectory: Trajectory, setup: SetupText) -> tuple[Checkpoint, EarlierWork] | None:
        """Return the checkpoint and the earlier work of a trajectory; None if it was not under way at the end.

        Args:
            trajectory: The trajectory.
            setup: Present setup of the robot.

        Raises:
            CommandRefused: It was under way with another setup; the journal stays as it is.
        """
        if self._paint is None:
            return None
        _, whose, kept_with, checkpoint, totals = self._newest()
        if checkpoint.leg < 0 or whose != digest(trajectory):
            return None
        if kept_with != setup.digest:
            raise CommandRefused(
                "this is not the robot, or not the world, in which the traversal was under way: "
                f"{self._changes_to(setup, kept_with)}. Start the robot with the vehicle and scenario that it had "
                "then, and load with resume again; or load without resume to begin anew"
            )
        return checkpoint, EarlierWork(totals, self._paint.read(whose, totals.points))

    def _changes_to(self, setup: SetupText, kept_with: bytes) -> str:
        try:
            earlier = SetupText(self._setup_path.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError):
            earlier = SetupText("")
        if earlier.digest != kept_with:
            return f"what differs is not known, as {self._setup_path} cannot be read or is of another traversal"
        return setup.changes_from(earlier)

    @property
    def checkpoint(self) -> Checkpoint | None:
        """Checkpoint of the kept job; None if none is kept, or it is over."""
        checkpoint = self._newest().checkpoint if self._map is not None else _OVER
        return checkpoint if checkpoint.leg >= 0 else None

    def ended_with(self, setup: SetupText) -> tuple[Checkpoint, Totals] | None:
        """Return the place and the totals at which the kept job ended, if it is of the same robot and world."""
        newest = self._newest() if self._map is not None else _NO_ENTRY
        return newest[3:] if newest.checkpoint.leg >= 0 and newest.setup == setup.digest else None

    def job(self) -> LoadRequest | None:
        """Return the request by which the kept job was loaded; None if there is none, or it cannot be read."""
        if self.checkpoint is None:
            return None
        try:
            job = decode(LoadRequest, self._job_path.read_bytes())
        except (OSError, PayloadError):
            return None
        return job if digest(job.trajectory) == self._newest().trajectory else None

    def begin(self, trajectory: bytes, setup: SetupText, job: bytes = b"") -> None:
        """Begin a traversal without paint.

        Args:
            trajectory: Digest of the trajectory.
            setup: Present setup of the robot.
            job: Encoded request by which it was loaded.
        """
        if self._paint is None:
            return
        self._trajectory, self._setup = trajectory, setup.digest
        self._write(_OVER, _NOTHING)  # there is nothing to resume once the last one's paint is gone
        self.problem, self._keeps_paint = "", True
        with suppress(OSError):  # a slot has its digest; only the differences could not be named
            self._setup_path.touch(mode=0o600)
            self._setup_path.write_text(setup.text, encoding="utf-8")
        with suppress(OSError):  # a client that has the plan can continue it
            self._job_path.touch(mode=0o600)
            self._job_path.write_bytes(job)
        try:
            self._paint.begin(trajectory)
        except OSError as error:
            self._lose_paint(error)

    def go_on(self) -> None:
        """Continue with the result of `unfinished`: later paint is written after that."""
        if self._paint is not None:
            self.problem, self._keeps_paint = "", True

    def write(self, checkpoint: Checkpoint, totals: Totals, paint: PaintLedger | None = None) -> None:
        """Write the progress, after the paint that has fallen since the last time, if any may have.

        Args:
            checkpoint: Place on the traversal.
            totals: Consumption and sums.
            paint: Ledger with the paint; None if no paint may have fallen.
        """
        if self._paint is None:
            return
        if paint is not None and self._keeps_paint and totals.points > self._paint.points:
            try:
                self._paint.append(paint.rows(self._paint.points))
            except OSError as error:
                self._lose_paint(error)
        self._write(checkpoint, totals)

    @property
    def latched(self) -> str | None:
        """Reason of a latched emergency stop, None if none is latched; "" if the reason cannot be read."""
        if self._map is None:
            return None
        raw = self._map[_LATCH_AT : _LATCH_AT + _LATCH.size + _CHECK.size]
        mark, reason = _LATCH.unpack(raw[: _LATCH.size])
        if mark != _LATCHED:
            return None
        whole = raw[_LATCH.size :] == _CHECK.pack(zlib.crc32(raw[: _LATCH.size]))
        return reason.rstrip(b"\0").decode("utf-8", "replace") if whole else ""

    def latch(self, reason: str) -> str:
        """Latch an emergency stop for the next process; return the reason if that fails, else ""."""
        if self._map is None:
            return self.problem or "the journal is closed"
        record = _LATCH.pack(_LATCHED, reason.encode()[:200])
        self._map[_LATCH_AT : _LATCH_AT + _LATCH.size + _CHECK.size] = record + _CHECK.pack(zlib.crc32(record))
        return ""

    def release(self) -> None:
        """Release the latched emergency stop."""
        if self._map is not None:
            self._map[_LATCH_AT : _LATCH_AT + _LATCH.size + _CHECK.size] = bytes(_LATCH.size + _CHECK.size)

    def end(self) -> None:
        """Note that the traversal is over."""
        if self._paint is not None:
            self._write(_OVER, _NOTHING)

    def _lose_paint(self, error: OSError) -> None:
        self._keeps_paint = False
        self.problem = f"the paint is not kept for a restart any more: {error.strerror or error}"

    def _write(self, checkpoint: Checkpoint, totals: Totals) -> None:
        self._number += 1
        leg, arc_length_m, owed_from_m, *rest, learned = checkpoint
        figures = learned or (math.nan,) * LEARNED_FIGURES
        owed = math.nan if owed_from_m is None else owed_from_m
        supplies, errors, points = totals
        whose = self._trajectory, self._setup
        record = _RECORD.pack(
            self._number, *whose, leg, arc_length_m, owed, *rest, *figures, *supplies, *errors, points
        )
        start = self._number % 2 * _SLOT
        assert self._map is not None, "open"
        self._map[start : start + _USED] = record + _CHECK.pack(zlib.crc32(record, _VERSION))

    def _newest(self) -> _Entry:
        return max(self._read(0), self._read(1), key=lambda entry: entry.number)

    def _read(self, slot: int) -> _Entry:
        assert self._map is not None, "open"
        raw = self._map[slot * _SLOT : slot * _SLOT + _USED]
        number, trajectory, setup, *place, points = _RECORD.unpack(raw[: _RECORD.size])
        if number == 0 or raw[_RECORD.size :] != _CHECK.pack(zlib.crc32(raw[: _RECORD.size], _VERSION)):
            return _NO_ENTRY
        leg, arc_length_m, owed, tick, elapsed_s, fallbacks, *figures = place
        learned, figures = tuple(figures[:LEARNED_FIGURES]), figures[LEARNED_FIGURES:]
        owed_from_m = None if math.isnan(owed) else owed
        checkpoint = Checkpoint(
            leg, arc_length_m, owed_from_m, tick, elapsed_s, fallbacks, () if math.isnan(learned[0]) else learned
        )
        tank_l, battery_wh, tank_reserve_l, battery_reserve_wh, *errors = figures
        supplies = (tank_l, battery_wh, tank_reserve_l, battery_reserve_wh)
        return _Entry(number, trajectory, setup, checkpoint, Totals(supplies, tuple(errors), points))
