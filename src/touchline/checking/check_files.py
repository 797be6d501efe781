"""Many recordings checked: which files, and a verdict on each that goes from process to process."""

from __future__ import annotations

import glob
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from touchline.checking.check_session import SessionCheck, check_recording
from touchline.checking.divergence import Divergence
from touchline.checking.session_metrics import SessionMetric
from touchline.checking.side_by_side import Progress
from touchline.schemas.errors import SpecError, TouchlineError

SUFFIX: Final = ".mcap"


@dataclass(frozen=True)
class TopicFigures:
    """How the messages of a topic compare; see `TopicCheck`."""

    pairs: int
    different: int
    only_recorded: int
    only_today: int
    largest: float
    largest_field: str
    unit: str
    first: Divergence | None

    def __str__(self) -> str:
        """In a line."""
        told = [f"{self.different:,} of {self.pairs:,} differ"] if self.different else []
        if self.largest_field:
            told[-1] += f" (largest {self.largest:.3g}{f' {self.unit}' if self.unit else ''} in {self.largest_field})"
        told += [f"{self.only_recorded:,} are missing today"] if self.only_recorded else []
        told += [f"{self.only_today:,} are new today"] if self.only_today else []
        return ", ".join(told)


@dataclass(frozen=True)
class SessionVerdict:
    """What came of one robot's session in one recording.

    Attributes:
        path: Of the recording.
        robot: Its namespace.
        passed: Whether today's code does the same.
        problem: Why that cannot be said; empty if it can.
        part: That differs first; empty if nothing does.
        first: The first difference in sim time.
        exact: Whether every bit had to be the same, as this is the platform on which the recording was made.
        messages: That were compared.
        sim_time_s: How long the session is.
        wall_time_s: How long the check took.
        notes: What else there is to know.
        topics: By name in the topic table, those that differ.
        process: Which process of the robot it was, from 1.
        made_by: By what it was recorded: versions and the platform.
        metrics: By which people judge the session, as recorded and today.
        schemas: By name of a topic, what is different in how it is recorded today.
    """

    path: str
    robot: str
    passed: bool
    problem: str = ""
    part: str = ""
    first: Divergence | None = None
    exact: bool = True
    messages: int = 0
    sim_time_s: float = 0.0
    wall_time_s: float = 0.0
    notes: tuple[str, ...] = ()
    topics: dict[str, TopicFigures] = field(default_factory=dict)
    process: int = 1
    made_by: Mapping[str, str] = field(default_factory=dict)
    metrics: tuple[SessionMetric, ...] = ()
    schemas: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def who(self) -> str:
        """The robot, and which of its processes if that is not the first."""
        return self.robot if self.process == 1 else f"{self.robot}, process {self.process}"

    def lines(self) -> Iterator[str]:
        """For a person: what differs, first of all where it does first."""
        name = f"{Path(self.path).name}{f' ({self.who})' if self.robot else ''}"
        if self.problem:
            yield f"{name}: {self.problem}"
        elif self.first is not None:
            yield f"{name}: differs first in the {self.part}: {self.first}"
        for topic, figures in self.topics.items():
            yield f"  {topic}: {figures}"
        yield from (f"{name}: {note}" for note in self.notes)


def recordings_in(places: Sequence[str]) -> list[Path]:
    """The recordings that are meant by files, folders (all recordings in them and below) and patterns.

    Raises:
        SpecError: One means none.
    """
    found: dict[Path, None] = {}
    for place in places:
        path = Path(place)
        if path.is_dir():
            here = sorted(path.rglob(f"*{SUFFIX}"))
        elif path.exists():
            here = [path]
        else:
            here = [Path(each) for each in sorted(glob.glob(place, recursive=True))]  # noqa: PTH207, may be absolute
        if not here:
            problem = "has no recording" if path.is_dir() else "is not there"
            raise SpecError("command line", place, problem, f"give files, folders or patterns of {SUFFIX} files")
        found.update(dict.fromkeys(here))
    return list(found)


def check_file(only: str, path: Path, progress: Progress = lambda done: None) -> list[SessionVerdict]:
    """Check a recording; what cannot be read is a verdict, too.

    Args:
        only: The part of a robot to be run alone on what was recorded; "" for all.
        path: Of the recording.
        progress: Told the fraction done.
    """
    begun = time.perf_counter()
    try:
        found = check_recording(path, only=only, progress=progress)
    except (TouchlineError, OSError) as error:
        return [SessionVerdict(str(path), "", False, str(error), wall_time_s=time.perf_counter() - begun)]
    wall_time_s = (time.perf_counter() - begun) / len(found)
    return [_verdict(path, one, wall_time_s) for one in found]


def lost_check(path: Path, why: str) -> list[SessionVerdict]:
    """What is said of a recording whose check died with its process."""
    return [SessionVerdict(str(path), "", False, why)]


def _verdict(path: Path, one: SessionCheck, wall_time_s: float) -> SessionVerdict:
    checks = one.diff.topics
    figures: dict[str, Any] = {
        name: TopicFigures(**{key: getattr(check, key) for key in TopicFigures.__dataclass_fields__})
        for name, check in checks.items()
        if not check.same
    }
    return SessionVerdict(
        str(path),
        one.robot,
        one.passed,
        one.problem,
        one.part,
        one.first,
        one.exact,
        sum(check.pairs for check in checks.values()),
        one.sim_time_s,
        wall_time_s,
        tuple(one.notes),
        figures,
        one.process,
        one.made_by,
        one.diff.metrics,
        one.diff.schemas,
    )
