"""Keeps the journal of what the emulator does: when it begins, goes on and ends, and what there is to say about it."""

from __future__ import annotations

from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import Trajectory, TraversalStatus
from touchline.services.onboard.executive.traversal import EMERGENCY_STOP
from touchline.services.onboard.interface import Checkpoint
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.journal import Journal
from touchline.services.robot_sim.recovery_state import Remains
from touchline.services.robot_sim.setup_text import SetupText


class JournalKeeper:
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
        self._latched = False

    def restore_latch(self) -> bool:
        """Stop if the last process ended in an emergency stop that nobody has reset; returns whether it did."""
        reason = self._journal.latched if self._journal is not None else None
        if reason is None:
            return False
        cause = f" ({reason})" if reason not in ("", EMERGENCY_STOP) else ""
        self._emulator.estop(f"{EMERGENCY_STOP} from before the restart{cause}; reset to release it")
        self._latched = True
        return True

    def note_latch(self) -> str:
        """Keep that there is, or no longer is, an emergency stop; returns what the operator should know."""
        stopped = self._emulator.onboard.state == TraversalStatus.ESTOPPED
        if self._journal is None or stopped == self._latched:
            return ""
        self._latched = stopped
        if not stopped:
            self._journal.release()
            return ""
        problem = self._journal.latch(self._emulator.onboard.status.reason)
        return f"the emergency stop would not survive a restart of the robot: {problem}" if problem else ""

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
