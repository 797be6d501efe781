"""`check()`: recorded sessions, run again with the present code."""

from __future__ import annotations

import html
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Literal

from touchline.api.given_arguments import Progress, no_progress
from touchline.checking.check_files import SessionVerdict, check_file, lost_check, recordings_in
from touchline.jobs.task_pool import spread
from touchline.recordings.writing import write_text

Component = Literal["plan", "estimator", "follower"]


@dataclass(frozen=True, repr=False)
class Check:
    """Outcome of a check.

    Attributes:
        sessions: A verdict on each robot's session, with the first difference and its cause.
    """

    sessions: tuple[SessionVerdict, ...]

    @property
    def passed(self) -> bool:
        """True if all sessions come out the same."""
        return all(session.passed for session in self.sessions)

    def __repr__(self) -> str:
        """One line: how many come out the same."""
        same = sum(session.passed for session in self.sessions)
        return f"Check({same} of {len(self.sessions)} sessions come out the same)"

    def lines(self) -> list[str]:
        """Differences and problems, a line each."""
        return [line for session in self.sessions for line in session.lines()]

    def _repr_html_(self) -> str:
        rows = "".join(f"<li>{html.escape(line)}</li>" for line in self.lines())
        return f"<p><code>{html.escape(repr(self))}</code></p><ul>{rows}</ul>"

    def to_html(self, path: str | Path, /) -> None:
        """Write the report as a page.

        Raises:
            SpecError: The file cannot be written.
        """
        from touchline.checking.check_page import page_of

        page = page_of(repr(self), list(self.sessions), {}, datetime.now().astimezone(), interrupted=False)
        write_text(page, Path(path))


def check(
    recordings: str | Path | Sequence[str | Path],
    /,
    *,
    only: Component | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Check:
    """Run recorded sessions again with the present code, and compare.

    Args:
        recordings: Recordings, folders of them, or glob patterns.
        only: Component to run alone on recorded inputs; None: the whole robot.
        workers: Number of processes; None: one per core.
        progress: Called with the fraction done and how many recordings that are.

    Raises:
        SpecError: There is no recording.
    """
    places = [recordings] if isinstance(recordings, str | Path) else recordings
    files, report = recordings_in([str(place) for place in places]), progress or no_progress
    found: list[SessionVerdict] = []
    with closing(spread(check_file, only or "", files, workers, lost_check)) as done:
        for number, verdicts in enumerate(done, 1):
            found += verdicts
            report(number / len(files), f"{number} of {len(files)} recordings")
    return Check(tuple(sorted(found, key=lambda each: (each.path, each.robot, each.process))))
