"""Conversion of one robot's messages to those that viewers draw, one by one as they come."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from touchline.recordings.viewing.body_frames import MovingFrame, Stamp, fixed_frames, pose_of, stamp_of
from touchline.recordings.viewing.markers import Floats, body_markers, template_markers
from touchline.recordings.viewing.obstacle_lines import ObstacleLines
from touchline.recordings.viewing.planned_poses import planned_poses
from touchline.recordings.viewing.tool_track import ToolTrack
from touchline.recordings.viewing.work_lines import WorkLines
from touchline.schemas import topics
from touchline.schemas.catalogue import parse_template
from touchline.schemas.cdr import decode, decode_structure, encode
from touchline.schemas.errors import PayloadError, SpecError
from touchline.schemas.frames import BODY_FRAME, TRUE_BODY_FRAME
from touchline.schemas.messages import Message, Obstacles, PaintMarks, String, Trajectory
from touchline.schemas.placement import to_map
from touchline.schemas.setup import Setup
from touchline.schemas.spec import parse
from touchline.schemas.template import Template
from touchline.schemas.topics import Topic


def frame_prefix(robot: str, robots: Collection[str]) -> str:
    """Return the prefix of a robot's frame names; one that is alone has the plain ones of REP-105."""
    return "" if len(robots) == 1 else f"{robot}/"


class Drawn(NamedTuple):
    """Message for viewers, with its topic."""

    topic: Topic
    payload: bytes


class PaintBatch(NamedTuple):
    """Stretch of paint: `PaintMarks` with its points (n, 2) in the map frame (m)."""

    segment_id: str
    first_index: int
    width_m: float
    points: Floats

    @classmethod
    def of(cls, marks: Any) -> PaintBatch:
        """Create it from a message, or from its fields.

        Raises:
            PayloadError: Its coordinates are not pairs of numbers.
        """
        if len(marks.x_m) != len(marks.y_m):
            raise PayloadError(f"{topics.PAINT.name}: x_m and y_m have different lengths")
        points = np.column_stack((marks.x_m, marks.y_m))
        if not np.isfinite(points).all():
            raise PayloadError(f"{topics.PAINT.name}: x_m or y_m is not finite")
        return cls(marks.segment_id, marks.first_index, marks.width_m, points)


class Viewing:
    """Drawing of one robot. The same messages give the same drawing, live and from a recording.

    Args:
        prefix: Prefix of the robot's own frames, so that those of several robots differ: ``r01/``.
    """

    def __init__(self, prefix: str = "") -> None:
        self._prefix = prefix
        self._body, self._true_body = MovingFrame(prefix + BODY_FRAME), MovingFrame(prefix + TRUE_BODY_FRAME)
        self._setup: Setup | None = None
        self._template: Template | None = None
        self._work: WorkLines | None = None
        self._marks: PaintBatch | None = None
        self._track: ToolTrack | None = None
        self._obstacles = ObstacleLines()
        self._of: dict[str, Callable[[bytes], Iterator[Drawn]]] = {
            topics.SETUP.name: self._take_setup,
            topics.TEMPLATE.name: self._take_template,
            topics.PLAN.name: self._take_plan,
            topics.ODOMETRY.name: self._take_odometry,
            topics.TRUTH.name: self._take_truth,
            topics.PAINT.name: self._take_paint,
            topics.OBSTACLES.name: self._take_obstacles,
        }

    def take(self, topic: str, payload: bytes) -> list[Drawn]:
        """Return the viewers' messages that a message adds; nothing if it does not fit its topic."""
        taker = self._of.get(topic)
        if taker is None:
            return []
        try:
            return list(taker(payload))
        except (PayloadError, SpecError):  # the reader of that topic reports it
            return []

    @property
    def covers(self) -> bool:
        """True if the robot's tool covers areas: its ground then follows from its path alone."""
        return self._track is not None

    def restore_paint(self, strokes: Sequence[PaintMarks]) -> list[Drawn]:
        """Replace the drawn paint by the robot's complete list of strokes."""
        self._work = self._marks = None
        for marks in strokes:
            self._add_paint(PaintBatch.of(marks))
        return self.whole_work()

    def whole_work(self) -> list[Drawn]:
        """Return all known work, whatever was drawn of it before."""
        work = self._work or WorkLines(0.0)
        return list(_work_drawn(*work.whole()))

    def pass_time(self, stamp: Stamp) -> list[Drawn]:
        """Advance the clock: the work of the last second is drawn even if no more is done."""
        return [] if self._work is None else list(_work_drawn(*self._work.due(stamp)))

    def _take_setup(self, payload: bytes) -> Iterator[Drawn]:
        self._setup = parse(Setup, decode(String, payload).data, "setup", recorded=True)
        vehicle = self._setup.vehicle
        self._track = ToolTrack(vehicle.tool.point_m) if vehicle.tool.covers else None
        yield _drawn(topics.STATIC_TRANSFORMS, fixed_frames(vehicle, self._prefix))
        yield _drawn(topics.BODY_MARKERS, body_markers(vehicle, self._prefix + BODY_FRAME))
        yield _drawn(topics.TRUE_BODY_MARKERS, body_markers(vehicle, self._prefix + TRUE_BODY_FRAME, true=True))
        if self._template is not None:  # live, it may have come first
            yield self._template_drawn(self._template)

    def _take_template(self, payload: bytes) -> Iterator[Drawn]:
        self._template = parse_template(decode(String, payload).data, recorded=True)
        yield self._template_drawn(self._template)
        if self._work is not None:
            older, latest = self._work.cleared()
            yield Drawn(topics.WORK_MARKERS, older)
            yield Drawn(topics.LATEST_WORK_MARKERS, latest)
        self._work = self._marks = None

    def _template_drawn(self, template: Template) -> Drawn:
        if self._setup is not None:
            template = to_map(template, self._setup.scenario.origin)
        return _drawn(topics.TEMPLATE_MARKERS, template_markers(template))

    def _take_plan(self, payload: bytes) -> Iterator[Drawn]:
        yield _drawn(topics.PLAN_PATH, planned_poses(decode(Trajectory, payload)))

    def _take_odometry(self, payload: bytes) -> Iterator[Drawn]:
        stamp = stamp_of(payload)
        if self._body.due(stamp):
            yield Drawn(topics.TRANSFORMS, self._body.at(stamp, pose_of(payload)))

    def _take_truth(self, payload: bytes) -> Iterator[Drawn]:
        stamp, pose = stamp_of(payload), pose_of(payload)
        if self._true_body.due(stamp):
            yield Drawn(topics.TRUE_TRANSFORMS, self._true_body.at(stamp, pose))
        if self._track is not None and (points := self._track.moved(pose)) is not None:
            assert self._setup is not None, "there is a track since the setup is known"
            self._work = self._work or WorkLines(self._setup.vehicle.tool.width_m, covers=True)
            self._work.add(points, goes_on=True)
        if self._work is not None:
            yield from _work_drawn(*self._work.due(stamp))

    def _take_paint(self, payload: bytes) -> Iterator[Drawn]:
        self._add_paint(PaintBatch.of(decode_structure(PaintMarks, payload)))  # validation takes as long again
        assert self._work is not None, "there is some since this paint"
        yield from _work_drawn(*self._work.due(stamp_of(payload)))

    def _take_obstacles(self, payload: bytes) -> Iterator[Drawn]:
        yield Drawn(topics.OBSTACLE_MARKERS, self._obstacles.pack(decode_structure(Obstacles, payload)))

    def _add_paint(self, marks: PaintBatch) -> None:
        before = self._marks
        if self._work is None or self._work.width_m != marks.width_m:
            self._work = WorkLines(marks.width_m)
        goes_on = (
            before is not None
            and before.segment_id == marks.segment_id
            and marks.first_index == before.first_index + len(before.points) - 1
        )
        self._marks = marks
        self._work.add(marks.points, goes_on=goes_on)


def _drawn(topic: Topic, message: Message) -> Drawn:
    return Drawn(topic, encode(message))


def _work_drawn(older: bytes | None, latest: bytes | None) -> Iterator[Drawn]:
    if older is not None:
        yield Drawn(topics.WORK_MARKERS, older)
    if latest is not None:
        yield Drawn(topics.LATEST_WORK_MARKERS, latest)


WORK: Final = frozenset((topics.WORK_MARKERS, topics.LATEST_WORK_MARKERS))
"""Topics that show a tool's work."""
SOURCES_OF: Final = {
    topics.TRANSFORMS: (topics.ODOMETRY,),
    topics.STATIC_TRANSFORMS: (topics.SETUP,),
    topics.PLAN_PATH: (topics.PLAN,),
    topics.TEMPLATE_MARKERS: (topics.SETUP, topics.TEMPLATE),
    topics.BODY_MARKERS: (topics.SETUP,),
    topics.TRUE_TRANSFORMS: (topics.TRUTH,),
    topics.TRUE_BODY_MARKERS: (topics.SETUP,),
    topics.OBSTACLE_MARKERS: (topics.OBSTACLES,),
    **dict.fromkeys(WORK, (topics.SETUP, topics.TEMPLATE, topics.PAINT, topics.CLOCK)),
}
"""Sources of each viewers' topic. The ground of a covering tool is made from `truth/odometry`."""
