"""Position of a replay and its next message: playing, pausing, seeking, stepping and repeating, on a given clock."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

from touchline.recordings.replay.replay_cue import Cue
from touchline.recordings.replay.replay_source import ReplaySource


@dataclass
class ReplayPlayer:
    """Plays a recording, or a part of it.

    Wall times are s of any steady clock. Recorded times, from here on *times*, are s on the recording's own clock.

    Attributes:
        source: The recording.
        speed: Sim time per wall time; 0 or less: as fast as possible.
        playing: Whether it runs.
        loops: Passes in all; 0: endless.
        from_s, to_s: Where each pass begins and ends, if not where the recording does.
        loop: The present pass, from 1.
        jumps: Seeks and new passes so far.
        now_s: All that is due until this time has been taken.
        ended: Whether the last pass is over.
        played_s: Sim time played in all.
    """

    source: ReplaySource
    speed: float = 1.0
    playing: bool = True
    loops: int = 1
    from_s: float = -math.inf
    to_s: float = math.inf
    loop: int = 1
    jumps: int = 0
    now_s: float = 0.0
    ended: bool = False
    played_s: float = 0.0
    _cues: Iterator[Cue] = field(init=False)
    _next: Cue | None = field(default=None, init=False)
    _held: deque[Cue] = field(default_factory=deque, init=False)
    """Messages in force after a jump, still to be taken."""
    _anchor: tuple[float, float] | None = field(default=None, init=False)
    """A wall time, and the replay's time then, while it plays at a speed."""
    _played_to_s: float = field(default=0.0, init=False)
    _steps: int = field(default=0, init=False)
    _rush_to_s: float | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        """Start at the beginning."""
        self.now_s = self._played_to_s = self.begin_s
        if self.from_s > self.source.begin_s:
            self._move(self.begin_s)
        else:
            self._cues = self.source.from_start()
            self._next = next(self._cues, None)
            self._rush_to_s = None if self.playing else self.now_s  # the state at the beginning is to be seen

    @property
    def begin_s(self) -> float:
        """Time at which a pass begins."""
        return max(self.source.begin_s, self.from_s)

    @property
    def end_s(self) -> float:
        """Time at which a pass ends; NaN if unknown."""
        end_s = self.source.begin_s + self.source.length_s
        return self.to_s if math.isnan(end_s) and self.to_s < math.inf else min(end_s, self.to_s)

    @property
    def jumping(self) -> bool:
        """True if messages in force after a jump are still to be taken."""
        return bool(self._held)

    @property
    def stepping(self) -> bool:
        """True if messages of a step are still to be taken."""
        return self._steps > 0 or self._rush_to_s is not None

    # -- commands ----------------------------------------------------------------------------------------------------

    def pause(self) -> None:
        """Pause the replay."""
        self.playing, self._anchor, self._steps, self._rush_to_s = False, None, 0, None

    def resume(self) -> None:
        """Resume the replay."""
        self.playing, self._anchor, self._steps, self._rush_to_s = True, None, 0, None

    def set_speed(self, speed: float) -> None:
        """Set the speed from now on."""
        self.speed, self._anchor = speed, None

    def seek(self, time_s: float) -> None:
        """Seek to a time, or to the nearer end; continue there if it plays."""
        self._steps, self._rush_to_s = 0, None
        self._move(min(max(time_s, self.begin_s), self.end_s if not math.isnan(self.end_s) else math.inf))
        self.jumps += 1

    def step(self, messages: int = 0, seconds: float = 0.0) -> None:
        """Take some messages, or those of some seconds, at once, and pause."""
        self.pause()
        self._steps = messages
        self._rush_to_s = self.now_s + seconds if seconds > 0.0 else None

    # -- output ------------------------------------------------------------------------------------------------------

    def take(self, wall_s: float) -> Cue | None:
        """Return the next message, if it is due; a new pass may have begun before it."""
        if self._held:
            return self._held.popleft()
        if not self.playing and not self.stepping:
            return None
        if self._next is None or self._time_of(self._next) > self.to_s:
            self._end_pass()
            return None
        cue, due_s = self._next, self._time_of(self._next)
        reached_s = self._reached_s(wall_s)
        if due_s > reached_s:
            self.now_s = max(self.now_s, reached_s)
            if self._rush_to_s is not None:  # a step is done
                self.pause()
            return None
        self.played_s += max(due_s - self._played_to_s, 0.0)
        self._played_to_s = self.now_s = max(self.now_s, due_s)
        self._next = next(self._cues, None)
        if self._steps:
            self._steps -= 1
        return cue

    def wait_s(self, wall_s: float, most_s: float) -> float:
        """Return how long nothing is due, as far as is known; at most ``most_s``."""
        if self._held or self.stepping:
            return 0.0
        if not self.playing:
            return most_s
        if self._next is None or self._anchor is None:
            return 0.0
        late_s = (self._time_of(self._next) - self._reached_s(wall_s)) / self.speed
        return min(max(late_s, 0.0), most_s)

    def _time_of(self, cue: Cue) -> float:
        return self.source.begin_s + cue.at_s

    def _reached_s(self, wall_s: float) -> float:
        """Return the time until which messages are due."""
        if self._steps:
            return math.inf
        if self._rush_to_s is not None:
            return self._rush_to_s
        if self.speed <= 0.0:
            return math.inf
        if self._anchor is None:
            self._anchor = wall_s, self.now_s
        anchor_wall_s, anchor_s = self._anchor
        return anchor_s + (wall_s - anchor_wall_s) * self.speed

    def _move(self, time_s: float, *, whole: bool = False) -> None:
        """Move to a time, with the messages in force then; or before everything, for a `whole` pass."""
        held, self._cues = self.source.jump(-math.inf if whole else time_s - self.source.begin_s)
        self._held, self._next = deque(held), next(self._cues, None)
        end_s = self.end_s  # may be known only now
        self.now_s = self._played_to_s = time_s if math.isnan(end_s) else min(time_s, end_s)
        self._anchor, self.ended = None, False

    def _end_pass(self) -> None:
        if not math.isnan(self.end_s):
            self.now_s = self.end_s
        if self.stepping:
            self.pause()
        elif self.loops == 0 or self.loop < self.loops:
            self.loop += 1
            self._move(self.begin_s, whole=self.begin_s == self.source.begin_s)
            self.jumps += 1
        else:
            self.pause()
            self.ended = True
