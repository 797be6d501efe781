"""Keeps the journal of what the emulator does: when it begins, goes on and ends, and what there is to say about it."""

from __future__ import annotations

from schemas.errors import CommandRefused
from schemas.messages import Trajectory
from services.robot_sim.emulator import Emulator
from services.robot_sim.frames import Checkpoint
from services.robot_sim.journal import Journal
from services.robot_sim.remains import Remains
from services.robot_sim.setups import SetupText


class Progress:
    """See the module; without a journal, nothing is kept.

    What was kept of the last traversal stays until the next one is under way.
    """

    def __init__(self, emulator: Emulator, journal: Journal | None) -> None:
        """Nothing loaded."""
        self._emulator, self._journal = emulator, journal
        self._setup = SetupText.of(emulator.setup)
        self._digest = b""
        self._resumed = self._under_way = False
        self._said = ""

    def unfinished(self, trajectory: Trajectory) -> tuple[Checkpoint, Remains]:
        """Where to go on with a trajectory, and with what.

        Raises:
            CommandRefused: It was not under way when the last process ended, or with another vehicle or scenario, or
                that cannot be known.
        """
        found = self._journal.unfinished(trajectory, self._setup) if self._journal is not None else None
        if found is None:
            problem = self._journal.problem if self._journal is not None else ""
            reason = problem or "the robot was not under way in this trajectory"
            raise CommandRefused(f"there is nothing to resume: {reason}")
        return found

    def loaded(self, whose: bytes, *, resumed: bool) -> str:
        """The trajectory of this digest will be under way; returns what the operator should know, "" for nothing."""
        if self._journal is None:
            return ""
        self._digest, self._resumed, self._under_way, self._said = whose, resumed, False, ""
        return self._news(self._journal)

    def note(self) -> str:
        """Note where the traversal is; returns what the operator should know, "" for nothing."""
        journal, emulator = self._journal, self._emulator
        if journal is None or not self._digest:
            return ""
        checkpoint = emulator.onboard.checkpoint
        if checkpoint is None:
            if self._under_way:
                journal.end()
                self._digest = b""
            return ""
        if not self._under_way:
            self._under_way = True
            if self._resumed:
                journal.go_on()
            else:
                journal.begin(self._digest, self._setup)
        journal.write(checkpoint, emulator.totals, emulator.ledger)
        return self._news(journal) if journal.problem else ""

    def _news(self, journal: Journal) -> str:
        news = journal.problem if journal.problem != self._said else ""
        self._said = journal.problem
        return news
