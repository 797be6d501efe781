"""One job over the bus by a robot that goes round things in its way: several drives, one report."""

from dataclasses import dataclass, field
from typing import Any, Final

from touchline.bus import Inbox
from touchline.jobs.shared.joint_paint import Work
from touchline.jobs.shared.reported_work import ReportedTruth
from touchline.jobs.single.bus_run import BusRun
from touchline.jobs.way_round.driven_paths import DrivenPaths
from touchline.jobs.way_round.drives_report import EndedDrive, drives_figures, ended_early, painted_drives
from touchline.jobs.way_round.work_done import WorkDone
from touchline.schemas import topics
from touchline.schemas.catalogue import parse_template
from touchline.schemas.messages import (
    Event,
    PaintMarks,
    PlanResponse,
    Trajectory,
    TraversalReport,
    TraversalStatus,
    WayRound,
)
from touchline.schemas.messages.base import Message
from touchline.schemas.template import Template
from touchline.services.robot_sim.way_round.swath_lines import with_swaths_as_lines
from touchline.services.robot_sim.way_round.uncovered_ground import left_out_grounds
from touchline.services.robot_sim.way_round.way_round_job import going_round

OF_ONE_DRIVE: Final = ("segments", "estimator")
"""Figures that are not given over several drives."""


@dataclass
class WayRoundRun(BusRun):
    """A job in progress, as `BusRun`, that goes on as long as the robot says so."""

    work: WorkDone | None = field(default=None, init=False)
    """Work of all drives, once the job is done in several."""
    strokes: list[PaintMarks] = field(default_factory=list, init=False)
    """Paint of all drives, once the job is done."""
    _told: list[WayRound] = field(default_factory=lambda: [WayRound()], init=False)
    _ended: list[EndedDrive] = field(default_factory=list, init=False)

    def run(self) -> dict[str, Any]:
        """See `BusRun.run`."""
        self._truth, self._driven = ReportedTruth(self.bus, self.options.vehicle), DrivenPaths(self.bus)
        return super().run()

    def _load_and_start(self, plan: PlanResponse, latest: Inbox) -> None:
        super()._load_and_start(plan, latest)
        self._truth.begin(self._of_job.since_s, self._of_job.since_s)

    def _hear(self, message: Message) -> None:
        super()._hear(message)
        if isinstance(message, TraversalReport) and self._of_job.report(message):
            self._ended.append(EndedDrive(message, self.contacts, ""))
            self.contacts = None
        elif isinstance(message, WayRound) and message.header.stamp.seconds >= self._of_job.since_s:
            self._told.append(message)

    @property
    def _said(self) -> WayRound:
        """Last report about things in the way."""
        return self._told[-1]

    @property
    def _over(self) -> bool:
        self._truth.listen()
        self._driven.listen()
        if not self._ended or self._said.continues:
            return False
        # Reports of two topics may arrive in any order: that of an earlier drive ends no job.
        begun_s = next(each.header.stamp.seconds for each in self._told if each.drives == self._said.drives)
        return self._ended[-1].report.header.stamp.seconds > begun_s

    @property
    def several(self) -> bool:
        """True if the robot has gone round something, or ended the job before its last line."""
        return len(self._ended) > 1 or bool(self._ended[-1].reason)

    def _report(
        self, plan: PlanResponse, status: TraversalStatus, wall_s: float, recording: dict[str, Any] | None
    ) -> dict[str, Any]:
        reasons = [*map(self._why, range(1, len(self._ended))), status.reason]
        self._ended = [each._replace(reason=why) for each, why in zip(self._ended, reasons, strict=True)]
        self.contacts = self._ended[-1].contacts
        figures = super()._report(plan, status, wall_s, recording)
        if not self.several:
            return figures
        template = parse_template(self.options.template_json)
        drives = self._truth.drives(template, [each.report.header.stamp.seconds for each in self._ended])
        self.strokes = [stroke for strokes, _ in drives for stroke in strokes]
        self.work = self._evaluated(template, plan.trajectory, [work for _, work in drives])
        for warning in self.work.warnings():
            self.watcher.event(Event.WARN, f"{topics.ROBOT_SIM}: {warning}")
        whole = drives_figures(self._ended, self.work, wall_s)
        if recording is not None and not recording["complete"] and whole["success"]:
            whole |= {"success": False, "reason": figures["reason"]}
        return {name: value for name, value in figures.items() if name not in OF_ONE_DRIVE} | whole

    def _why(self, drive: int) -> str:
        """Return why a drive, by its number from 1, has ended early; "" if it has not."""
        end_s = self._ended[drive - 1].report.header.stamp.seconds
        told = [each for each in self._told if each.drives == drive and each.header.stamp.seconds < end_s]
        return going_round(told[-1].things) if told and told[-1].state == WayRound.PLANS else ""

    def _evaluated(self, template: Template, trajectory: Trajectory, works: list[Work]) -> WorkDone:
        """Evaluate the work of all drives; takes a moment.

        Args:
            template: The whole template.
            trajectory: Its plan.
            works: True work of each drive.
        """
        vehicle, said = self.options.vehicle, self._said
        if not (template.areas and vehicle.tool.covers):
            lines = with_swaths_as_lines(template, trajectory, vehicle)
            return painted_drives(lines, vehicle, works, said.left_out, ended_early(self._ended[-1].reason))
        from touchline.jobs.way_round.covered_areas import covered_areas

        notes = left_out_grounds(said.left_out_patches)
        return covered_areas(template, vehicle, self._driven.last(len(works)), works, notes)
