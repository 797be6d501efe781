"""Source of a replay: a recording from its beginning, or from any time on with the messages in force then."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from datetime import datetime
from itertools import chain
from pathlib import Path

from touchline.recordings.replay.held_messages import HeldMessages
from touchline.recordings.replay.replay_cue import Cue
from touchline.recordings.replay.replayer import IndexedTimeline, Timeline
from touchline.recordings.wall_times import BEGUN, as_wall_time, noted_wall_time


class ReplaySource:
    """One recording. Files with an index are read where needed, others from the beginning.

    Attributes:
        begin_s: Log time of the first cue: the recording's own clock there.
        length_s: Time of the last cue; NaN while unknown, for a recording without an index.
        skipped: Messages skipped, of those read from the beginning on.
        problem: What could not be read; empty if all could, or while it has not been read.
        reasons: Why messages of known topics were skipped.

    Raises:
        RecordingError: It cannot be opened, or is none.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._timeline = Timeline(path)
        cues = self._timeline.cues()
        first = next(cues, None)
        self._ahead: Iterator[Cue] | None = chain([first] if first is not None else [], cues)
        self.begin_s = self._timeline.begin_s or 0.0
        self.skipped = 0
        self.problem = ""
        self.reasons: Sequence[str] = self._timeline.reasons
        self._indexed = IndexedTimeline.of(path)
        self.length_s = self._indexed.length_s if self._indexed is not None else math.nan
        self._holds_true()

    def _holds_true(self) -> None:
        """True if the index agrees with the messages on the beginning; else it is not used."""
        if self._indexed is not None and self._indexed.begin_s != self.begin_s:
            self._indexed, self.length_s = None, math.nan

    @property
    def fraction(self) -> float:
        """Share that has been read, 0…1, where the length is unknown."""
        return self._timeline.reader.fraction

    def begin_wall_s(self, time_s: float) -> float:
        """Return the wall time at a time of the recording, s since 1970; 0 if unknown.

        It is exact only at the beginning: the pace of sim time is not recorded.
        """
        if as_wall_time(round(1e9 * self.begin_s)) is not None:
            return time_s
        noted = noted_wall_time(self._timeline.reader.summary.metadata, BEGUN)
        begun_s = datetime.fromisoformat(noted).timestamp() if noted is not None else 0.0
        return begun_s if time_s == self.begin_s else 0.0

    def close(self) -> None:
        """Close the file; harmless when repeated."""
        self._timeline.close()

    def from_start(self) -> Iterator[Cue]:
        """Yield every cue."""
        ahead, self._ahead = self._ahead, None
        if ahead is None:
            self._timeline.close()
            self._timeline = Timeline(self._path)
            ahead = self._timeline.cues()
        at_s = 0.0
        for cue in ahead:
            at_s = cue.at_s
            yield cue
        self._read_through(at_s)

    def jump(self, at_s: float) -> tuple[Sequence[Cue], Iterator[Cue]]:
        """Return the messages in force after all that is due up to then, and those due later."""
        if self._indexed is not None:
            return self._indexed.standing(at_s).cues(), self._indexed.after(at_s)
        standing, cues = HeldMessages(), self.from_start()
        for cue in cues:
            if cue.at_s > at_s:
                return standing.cues(), chain([cue], cues)
            standing.take(cue)
        return standing.cues(), iter(())

    def _read_through(self, at_s: float) -> None:
        """Note that the end of the recording is at that time."""
        self.skipped, self.reasons = self._timeline.skipped, tuple(self._timeline.reasons)
        self.problem = self._timeline.reader.summary.problem
        if math.isnan(self.length_s):
            self.length_s = at_s
