"""Rest of a job, by the robot's own record of its work: lines to paint, or ground to cover."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Final, NamedTuple, Protocol

from touchline.onboard.interface import PaintBelief
from touchline.schemas.ground_piece import GroundPiece
from touchline.schemas.messages import LeftOutPatch, LeftOutStretch, Trajectory
from touchline.schemas.template import Polygon, Template

OPERATOR: Final = "operator"
"""Reason for which an operator has left something out."""
PLAN: Final = "plan"
"""Reason for which the plan of the whole job leaves something out."""
TOO_SMALL: Final = "too small"
"""Reason for which ground that a drive has left over is not worth another one: a strip or a small piece."""


class Clearances(NamedTuple):
    """Distances by which plans of the rest keep off what was seen.

    Attributes:
        left_m: Distance from the standing robot that is taken as free.
        far_side_m: Allowance for the sides of things that the robot has not seen.
    """

    left_m: float
    far_side_m: float


class Rest(NamedTuple):
    """Rest of a job, to be planned.

    Attributes:
        template: The job's template with the rest of its lines, or all of its areas.
        pieces: The rest of the areas.
    """

    template: Template
    pieces: tuple[GroundPiece, ...] = ()


class LeftOut(NamedTuple):
    """Undone work.

    Attributes:
        stretches: Stretches of lines.
        patches: Patches of areas.
    """

    stretches: tuple[LeftOutStretch, ...] = ()
    patches: tuple[LeftOutPatch, ...] = ()


class Remains(Protocol):
    """Undone work of a job, and the reasons for which it was left out.

    A reason is the id of the outline beside which something lies, `OPERATOR`, `PLAN`, `TOO_SMALL`, or "" if there is
    none.
    """

    clearances: Clearances
    """Distances by which plans of the rest keep off what was seen."""

    template: Template
    """The whole template, in the map frame; for a tool that paints, with the swaths of its areas as lines."""

    @property
    def done(self) -> float:
        """Amount of work done, m or m²."""

    @property
    def left_out(self) -> LeftOut:
        """Undone work that was left out; of other work it is not known whether it will be done."""

    @property
    def undone(self) -> LeftOut:
        """All undone work."""

    @property
    def reasons_left(self) -> set[str]:
        """Reasons of what was left out and is still undone."""

    @property
    def unexplained(self) -> bool:
        """True if there is undone work most of which was not left out for any reason."""

    def enter(self, trajectory: Trajectory, painted: PaintBelief, reached_m: float) -> None:
        """Enter the work of a drive.

        Args:
            trajectory: Its plan.
            painted: The robot's paint record of it.
            reached_m: Arc length up to which the robot has driven it.
        """

    def note_plan(self, trajectory: Trajectory) -> None:
        """Note what a plan of the whole template leaves out."""

    def rest(self, without: Collection[str], seen: Sequence[Polygon]) -> Rest | None:
        """Return what remains and is worth a plan; None if nothing is.

        Args:
            without: Reasons of what is left out for good.
            seen: Outlines that the robot has seen, with the distance that it keeps.
        """

    def note(
        self, rest: Rest, seen: Sequence[Polygon], trajectory: Trajectory, stretches: Iterable[LeftOutStretch]
    ) -> None:
        """Note what the plan of a rest leaves out, and beside what; earlier notes of the rest go.

        Until `retry` what is left out of lines is no part of the rest.

        Args:
            rest: The rest.
            seen: Outlines that the plan keeps off.
            trajectory: The plan.
            stretches: Stretches of lines that it leaves out.
        """

    def skip(self, trajectory: Trajectory, reached_m: float, place: tuple[float, float], reason: str) -> bool:
        """Leave out, until `retry`, the beginning of what the robot is about to paint, if that is near.

        Args:
            trajectory: Its plan.
            reached_m: Arc length up to which the robot has driven it.
            place: x (m) and y (m) of the robot.
            reason: The reason.

        Returns:
            True if something is left out.
        """

    def retry(self) -> None:
        """Put what was left out among the rest again; from then on it stays there, unless it is skipped again."""

    def give_reason(self, reason: str) -> None:
        """Give a reason for all that is undone and has none."""

    def leave_out(self, outlines: Collection[str], reason: str) -> None:
        """Give another reason for what was left out beside these outlines."""
