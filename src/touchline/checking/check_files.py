"""Checks of many recordings: their files, and a verdict on each that passes between processes."""

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
from touchline.checking.streamed_comparison import Progress
from touchline.schemas.errors import SpecError, TouchlineError

SUFFIX: Final = ".mcap"


@dataclass(frozen=True)
class TopicFigures:
    """Comparison of a topic's messages; see `TopicCheck`."""

    pairs: int
    different: int
    only_recorded: int
    only_today: int
    largest: float
    largest_field: str
    unit: str
    first: Divergence | None

    def __str__(self) -> str:
        """Return it as one line."""
        texts = [f"{self.different:,} of {self.pairs:,} differ"] if self.different else []
        if self.largest_field:
            texts[-1] += f" (largest {self.largest:.3g}{f' {self.unit}' if self.unit else ''} in {self.largest_field})"
        texts += [f"{self.only_recorded:,} are missing now"] if self.only_recorded else []
        texts += [f"{self.only_today:,} are new"] if self.only_today else []
        return ", ".join(texts)


@dataclass(frozen=True)
class SessionVerdict:
    """Verdict on one robot's session in one recording.

    Attributes:
        path: Path of the recording.
        robot: Namespace of the robot.
        passed: Whether the present code does the same.
        problem: Why the session cannot be checked; empty if it can.
        part: Component that differs first; empty if nothing differs.
        first: First difference in sim time.
        exact: Whether every bit had to be the same, as the recording was made on this platform.
        messages: Number of messages compared.
        sim_time_s: Length of the session.
        wall_time_s: Duration of the check.
        notes: Further remarks.
        topics: Differing topics, by name in the topic table.
        process: Which process of the robot it was, from 1.
        made_by: Versions and platform of the recording.
        metrics: Main figures of the session, recorded and now.
        schemas: Changes in how topics are recorded, by topic.
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
        """Robot, and its process unless that is the first."""
        return self.robot if self.process == 1 else f"{self.robot}, process {self.process}"

    def lines(self) -> Iterator[str]:
        """Yield lines for a person, the first difference first."""
        name = f"{Path(self.path).name}{f' ({self.who})' if self.robot else ''}"
        if self.problem:
            yield f"{name}: {self.problem}"
        elif self.first is not None:
            yield f"{name}: differs first in the {self.part}: {self.first}"
        for topic, figures in self.topics.items():
            yield f"  {topic}: {figures}"
        yield from (f"{name}: {note}" for note in self.notes)


def recordings_in(places: Sequence[str]) -> list[Path]:
    """Return the recordings in files, folders (searched recursively) and patterns.

    Raises:
        SpecError: One of them holds no recording.
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
    """Check a recording; an unreadable one gets a verdict, too.

    Args:
        only: Component to run alone on recorded inputs; "" for the whole robot.
        path: Path of the recording.
        progress: Called with the fraction done.
    """
    begun = time.perf_counter()
    try:
        found = check_recording(path, only=only, progress=progress)
    except (TouchlineError, OSError) as error:
        return [SessionVerdict(str(path), "", False, str(error), wall_time_s=time.perf_counter() - begun)]
    wall_time_s = (time.perf_counter() - begun) / len(found)
    return [_verdict(path, one, wall_time_s) for one in found]


def lost_check(path: Path, why: str) -> list[SessionVerdict]:
    """Return the verdict on a recording whose check died with its process."""
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
