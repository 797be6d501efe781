"""Figures and picture of a job of several drives round things in its way."""

import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from touchline.jobs.shared.joint_paint import JointPaint, Work, joint_paint
from touchline.jobs.single.painted_picture import MIN_WIDTH_PT, paint
from touchline.jobs.single.reports import all_contacts, all_lines_figures, contact_figures, hit_something
from touchline.jobs.way_round.work_done import WorkDone
from touchline.schemas.messages import ContactReport, Header, LeftOutStretch, PaintMarks, TraversalReport
from touchline.schemas.plain_text import plain
from touchline.schemas.swath_ids import whole_line_id
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.paint_messages import painting_report
from touchline.services.robot_sim.way_round.remains import OPERATOR, PLAN
from touchline.services.robot_sim.way_round.unpainted_lines import painted_lines
from touchline.services.robot_sim.way_round.way_round_job import REST_LEFT_OUT

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GAP_COLOUR: Final = "#ffb0b0"
GAP_POINTS: Final = 21


@dataclass(frozen=True)
class PaintedDrives:
    """Lines painted in several drives; see `WorkDone`.

    Attributes:
        template: The whole template.
        paint: Paint of all drives, against the painted parts of the template.
        gaps: What is not painted.
        ended: Why the job ended before the robot came to all of it, or empty.
    """

    template: Template
    paint: JointPaint
    gaps: tuple[LeftOutStretch, ...]
    ended: str

    @property
    def report(self) -> TraversalReport:
        """See `WorkDone`."""
        made = painting_report(Header(), self.paint.metrics, self.paint.tolerance_m, done=True)
        return made.model_copy(update={"wet_crossings": self.paint.wet_crossings})

    @property
    def area(self) -> None:
        """See `WorkDone`."""
        return None

    @property
    def refusal(self) -> str:
        """See `WorkDone`."""
        verdict = self.paint.metrics.verdict
        return "" if verdict.accepted else f"the paint is not accepted: {verdict.text}"

    def figures(self) -> dict[str, Any]:
        """See `WorkDone`."""
        figures, metrics = self.paint.figures(), self.paint.metrics
        if self.gaps:
            figures |= all_lines_figures(self.gaps, metrics.template_length_m, metrics.coverage_pct)
        return {"paint": figures, "gaps": gap_figures(self.gaps, self.ended)}

    def warnings(self) -> Iterator[str]:
        """See `WorkDone`."""
        yield from (gap_words(gap) for gap in self.gaps if gap.outline != PLAN and (gap.outline or not self.ended))
        rest_m = math.fsum(gap.length_m for gap in self.gaps if not gap.outline)
        if self.ended and rest_m:
            yield f"{rest_m:.2f} m {_not_painted(self.ended)}"

    def draw_into(self, axes: "Axes", strokes: Iterable[PaintMarks]) -> None:
        """See `WorkDone`."""
        curves = {segment.id: segment.curve() for segment in self.template.segments}
        paint(axes, self.template, [_of_line(stroke, curves) for stroke in strokes], self.paint.caption())
        for gap in self.gaps:
            x, y, _, _ = curves[gap.line_id].at(np.linspace(gap.from_m, gap.to_m, GAP_POINTS))
            axes.plot(x, y, color=GAP_COLOUR, linestyle=":", linewidth=MIN_WIDTH_PT, gid="gap")
            name = f"{gap.outline or 'not painted'}, {gap.length_m:.2f} m"
            axes.annotate(plain(name), (x[GAP_POINTS // 2], y[GAP_POINTS // 2]), color=GAP_COLOUR, fontsize="small")


def painted_drives(
    template: Template, vehicle: Vehicle, works: Sequence[Work], gaps: tuple[LeftOutStretch, ...], ended: str
) -> PaintedDrives:
    """Evaluate all the paint together; takes a moment.

    Args:
        template: The whole template, lines only.
        vehicle: Vehicle that paints.
        works: True work of each drive.
        gaps: What is not painted.
        ended: As in `PaintedDrives`.
    """
    return PaintedDrives(template, joint_paint(painted_lines(template, gaps), vehicle, works), gaps, ended)


def _of_line(stroke: PaintMarks, lines: Collection[str]) -> PaintMarks:
    """Return a stroke under the name of its line, if it is one of a part of that, or of a part of a part."""
    name = whole_line_id(stroke.segment_id, lines)
    return stroke.model_copy(update={"segment_id": name or stroke.segment_id})


def gap_figures(gaps: Sequence[LeftOutStretch], ended: str = "") -> dict[str, Any]:
    """Return unpainted parts of lines as figures of a report; `ended` as in `PaintedDrives`."""
    return {
        "total_m": math.fsum(gap.length_m for gap in gaps),
        "stretches": [
            {
                "line": gap.line_id,
                "along_m": [gap.from_m, gap.to_m],
                "from_m": [gap.from_x_m, gap.from_y_m],
                "to_m": [gap.to_x_m, gap.to_y_m],
                "reason": gap.outline or _not_painted(ended),
            }
            for gap in gaps
        ],
    }


def _not_painted(ended: str) -> str:
    return f"not painted: {ended}" if ended else "not painted"


def gap_words(gap: LeftOutStretch) -> str:
    """Return length, line, place and reason of an unpainted part of a line as text."""
    why = {"": "not painted", OPERATOR: "left out by the operator"}.get(gap.outline, f'left out beside "{gap.outline}"')
    from_, to = f"({gap.from_x_m:.2f}, {gap.from_y_m:.2f})", f"({gap.to_x_m:.2f}, {gap.to_y_m:.2f})"
    return f'{gap.length_m:.2f} m of "{gap.line_id}" from {from_} to {to}: {why}'


class EndedDrive(NamedTuple):
    """A drive of a job.

    Attributes:
        report: Its report.
        contacts: Its contacts with things, if there were any.
        reason: Why it ended early, or empty.
    """

    report: TraversalReport
    contacts: ContactReport | None
    reason: str


def ended_early(reason: str) -> str:
    """Return why a job ended before its robot came to all of it, by why its last drive did; "" if it did not."""
    return "" if reason == REST_LEFT_OUT else reason


def failure(drives: Sequence[EndedDrive], work: WorkDone) -> str:
    """Return why a job is no success; "" if it is one. One that is done but for what cannot be reached is one.

    Args:
        drives: Its drives in order.
        work: Work of all of them.
    """
    hit = hit_something(all_contacts([each.contacts for each in drives]))
    return ended_early(drives[-1].reason) or hit or work.refusal


def drives_figures(drives: Sequence[EndedDrive], work: WorkDone, wall_time_s: float) -> dict[str, Any]:
    """Return the report of a job over all its drives.

    Args:
        drives: The drives in order.
        work: Work of all of them.
        wall_time_s: Wall-clock time of the job.
    """
    total_s, reason = sum(each.report.total_time_s for each in drives), failure(drives, work)
    return {
        "success": not reason,
        "reason": reason,
        "traversal": {
            "total_time_s": total_s,
            "wall_time_s": wall_time_s,
            "real_time_factor": total_s / wall_time_s,
            "follower_fallbacks": sum(each.report.follower_fallbacks for each in drives),
        },
        **work.figures(),
        "drives": [each.reason or "done" for each in drives],
        **contact_figures(all_contacts([each.contacts for each in drives])),
    }
