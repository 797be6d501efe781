"""The figures of a traversal when it ends, and its reports, which may be made later and by another thread."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from touchline.onboard.interface import Status
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.digest import SessionDigest
from touchline.services.robot_sim.accounting.area_metrics import AreaMetrics
from touchline.services.robot_sim.area_messages import area_report, covering_report
from touchline.services.robot_sim.packing import Payload, header
from touchline.services.robot_sim.paint.ledger import PaintLedger
from touchline.services.robot_sim.paint.metrics import paint_metrics
from touchline.services.robot_sim.paint.smears import Smearing, SmearPrint
from touchline.services.robot_sim.paint_messages import painting_report


class Reports(NamedTuple):
    """Reports of a traversal; `area` if a covering tool has worked on areas, `contacts` if there were any."""

    traversal: m.TraversalReport
    area: m.AreaReport | None
    contacts: m.ContactReport | None

    def payloads(self) -> list[Payload]:
        """Pack them; that of the traversal comes last, because it ends the session."""
        areas = [(topics.AREA_REPORT, encode(self.area))] if self.area is not None else []
        contacts = [(topics.CONTACT_REPORT, encode(self.contacts))] if self.contacts is not None else []
        return [*areas, *contacts, (topics.REPORT, encode(self.traversal))]


class Figures(NamedTuple):
    """Data for the report of a traversal, in any thread: a copy of its end, while the robot may continue.

    Attributes:
        tick: Tick of the copy.
        status: Status of the onboard computer.
        rmse: Error of the estimate: position [m], heading [rad].
        ledger: Paint.
        smearing: Computes the smears of it.
        areas: Computes the figures of areas that a covering tool has worked on, if there are any.
        contacts: Report of contacts with things, if there were any.
        digest: Hash of the messages until then.
    """

    tick: int
    status: Status
    rmse: tuple[float, float]
    ledger: PaintLedger
    smearing: Callable[[], Smearing]
    areas: Callable[[], AreaMetrics] | None
    contacts: m.ContactReport | None
    digest: SessionDigest

    def reports(self) -> Reports:
        """Compute the reports; takes a moment."""
        made = Reports(self._of_lines(), None, self.contacts) if self.areas is None else self._of_areas(self.areas())
        if self.contacts is None or not self.contacts.while_moving:
            return made
        return made._replace(traversal=made.traversal.model_copy(update={"success": False}))

    def final_reports(self) -> Reports:
        """Compute the reports; that of the traversal has the hash of all messages of the session, both included."""
        reports = self.reports()
        self.digest.add(reports.payloads())
        traversal = reports.traversal.model_copy(update={"session_hash": self.digest.hexdigest()})
        return reports._replace(traversal=traversal)

    def _of_areas(self, metrics: AreaMetrics) -> Reports:
        status, head = self.status, header(self.tick)
        traversal = covering_report(head, metrics, done=status.state == m.TraversalStatus.DONE).model_copy(
            update={
                "total_time_s": status.elapsed_s,
                "position_rmse_m": self.rmse[0],
                "heading_rmse_rad": self.rmse[1],
                "follower_fallbacks": status.follower_fallbacks,
            }
        )
        return Reports(traversal, area_report(head, metrics), self.contacts)

    def _of_lines(self) -> m.TraversalReport:
        metrics, smearing, status = paint_metrics(self.ledger), self.smearing(), self.status
        done = status.state == m.TraversalStatus.DONE
        return painting_report(header(self.tick), metrics, self.ledger.tolerance_m, done=done).model_copy(
            update={
                "total_time_s": status.elapsed_s,
                "position_rmse_m": self.rmse[0],
                "heading_rmse_rad": self.rmse[1],
                "follower_fallbacks": status.follower_fallbacks,
                "wet_crossings": smearing.crossings,
                "wet_youngest_s": smearing.youngest_s,
                "smeared_m2": smearing.area_m2,
                "smears": tuple(_smear(smear, self.ledger.ids) for smear in smearing.smears),
            }
        )


def _smear(smear: SmearPrint, ids: Sequence[str]) -> m.Smear:
    return m.Smear(
        segment_id=ids[smear.line] if smear.line >= 0 else "",
        age_s=smear.age_s,
        strength=smear.strength,
        width_m=smear.width_m,
        x_m=smear.points[:, 0],
        y_m=smear.points[:, 1],
    )
