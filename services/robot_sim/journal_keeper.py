"""Journal keeping: follows the emulator's jobs from start to end, and reports problems."""

from __future__ import annotations

from typing import NamedTuple

from touchline.onboard.executive.stop_causes import EMERGENCY_STOP
from touchline.onboard.interface import Checkpoint
from touchline.schemas.errors import CommandRefused, SpecError
from touchline.schemas.messages import LoadRequest, Trajectory, TraversalStatus, UnfinishedJob
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.journal import Journal
from touchline.services.robot_sim.packing import header
from touchline.services.robot_sim.recovery_state import EarlierWork
from touchline.services.robot_sim.setup_text import SetupText
from touchline.services.robot_sim.unfinished import unfinished_before, unfinished_here


class Taken(NamedTuple):
    """A trajectory that was loaded.

    Attributes:
        digest: Digest of the trajectory.
        request: Request by which it was loaded, encoded.
        name: Name of its template.
        works: True if there is work to do along it, not only a path to drive.
        resumed: True if it continues a kept job.
    """

    digest: bytes
    request: bytes
    name: str
    works: bool
    resumed: bool


class JournalKeeper:
    """Keeper of a robot's journal; without a journal, nothing is kept.

    The entry of the last traversal stays until the next one is under way; a job that was not finished stays until the
    next one with work to do is: the robot may be driven elsewhere in between.

    Attributes:
        unfinished: Job that the robot could continue and is not on now; without a length, there is none.
    """

    def __init__(self, emulator: Emulator, journal: Journal | None) -> None:
        """Begin without a loaded trajectory."""
        self._emulator, self._journal = emulator, journal
        self._setup = SetupText.of(emulator.setup)
        self._taken: Taken | None = None
        self._under_way = False
        self._aborted = journal.ended_with(self._setup) if journal is not None else None
        """End of the job that can be continued, and the levels since."""
        if self._aborted is not None:
            emulator.begin_with(self._aborted[1].supplies)
        self.unfinished = self._unfinished_before()
        self._reported = ""
        self._latched = False

    def restore_latch(self) -> bool:
        """Stop if the last process ended in an emergency stop that nobody has reset; return True if it did."""
        reason = self._journal.latched if self._journal is not None else None
        if reason is None:
            return False
        cause = f" ({reason})" if reason not in ("", EMERGENCY_STOP) else ""
        self._emulator.estop(f"{EMERGENCY_STOP} from before the restart{cause}; reset to release it")
        self._latched = True
        return True

    def note_latch(self) -> str:
        """Keep or release the latch of an emergency stop; return a text for the operator, "" for none."""
        stopped = self._emulator.onboard.state == TraversalStatus.ESTOPPED
        if self._journal is None or stopped == self._latched:
            return ""
        self._latched = stopped
        if not stopped:
            self._journal.release()
            return ""
        problem = self._journal.latch(self._emulator.onboard.status.reason)
        return f"the emergency stop would not survive a restart of the robot: {problem}" if problem else ""

    def _unfinished_before(self) -> UnfinishedJob:
        checkpoint = self._journal.checkpoint if self._journal is not None else None
        job = self._journal.job() if self._journal is not None else None
        if checkpoint is None or job is None:
            return UnfinishedJob()
        try:
            return unfinished_before(job, checkpoint, self._emulator.vehicle)
        except SpecError:  # a template of another version
            return UnfinishedJob()

    def kept_job(self) -> LoadRequest:
        """Return the request by which the job was loaded that can be continued.

        Raises:
            CommandRefused: There is none, or it cannot be read.
        """
        job = self._journal.job() if self._journal is not None else None
        if job is None:
            raise CommandRefused("there is nothing to resume: the robot keeps no unfinished job; load a plan")
        return job

    def to_resume(self, trajectory: Trajectory) -> tuple[Checkpoint, EarlierWork]:
        """Return the checkpoint and the earlier work of a trajectory.

        Raises:
            CommandRefused: It was not under way last, or with another vehicle or scenario, or that cannot be known.
        """
        found = self._journal.unfinished(trajectory, self._setup) if self._journal is not None else None
        if found is None:
            problem = self._journal.problem if self._journal is not None else ""
            reason = problem or "the robot was not under way in this trajectory"
            raise CommandRefused(f"there is nothing to resume: {reason}")
        return found

    def as_of_now(self, earlier: EarlierWork) -> EarlierWork:
        """Update the levels of earlier work to the present ones: the tank may have been filled since."""
        return earlier._replace(totals=earlier.totals._replace(supplies=self._emulator.world.supplies))

    def loaded(self, taken: Taken) -> str:
        """Note that this trajectory will be under way; return a text for the operator, "" for none."""
        if self._journal is None:
            return ""
        keeps = taken.works or not self.unfinished.total_length_m
        self._taken, self._under_way, self._reported = taken if keeps else None, False, ""
        return self._news(self._journal)

    def note(self) -> str:
        """Note the progress of the traversal; return a text for the operator, "" for none."""
        journal, emulator, taken = self._journal, self._emulator, self._taken
        if journal is None:
            return ""
        checkpoint = emulator.onboard.checkpoint if taken is not None else None
        if taken is None or checkpoint is None:
            self._note_rest(journal)
            return ""
        if not self._under_way:
            if emulator.onboard.state == TraversalStatus.ABORTED:  # before it was started
                return ""
            self._set_off(journal, taken)
        totals = emulator.totals
        journal.write(checkpoint, totals, emulator.work.ledger)
        if emulator.onboard.state == TraversalStatus.ABORTED:
            self._aborted = checkpoint, totals
            if not self.unfinished.total_length_m or emulator.settled:
                self.unfinished = unfinished_here(taken.name, emulator, header(emulator.tick_count))
        return self._news(journal) if journal.problem else ""

    def _set_off(self, journal: Journal, taken: Taken) -> None:
        self._under_way, self._aborted = True, None
        if self.unfinished.total_length_m:
            self.unfinished = UnfinishedJob()
        if taken.resumed:
            journal.go_on()
        else:
            journal.begin(taken.digest, self._setup, taken.request)

    def _note_rest(self, journal: Journal) -> None:
        """Note that the traversal is over, or, for an aborted job, the present levels of tank and battery."""
        if self._under_way and self._emulator.onboard.state == TraversalStatus.DONE:
            journal.end()
        elif self._aborted is not None:
            checkpoint, totals = self._aborted
            supplies = self._emulator.world.supplies
            if supplies != totals.supplies:
                self._aborted = checkpoint, totals._replace(supplies=supplies)
                journal.write(*self._aborted)
        self._taken, self._under_way = (None, False) if self._under_way else (self._taken, False)

    def _news(self, journal: Journal) -> str:
        news = journal.problem if journal.problem != self._reported else ""
        self._reported = journal.problem
        return news
