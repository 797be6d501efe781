"""Output of ``touchline study reality``: logs beside the emulator, as tables, Markdown or JSON."""

from collections.abc import Sequence
from pathlib import Path

from touchline.cli.display import progress_bar
from touchline.cli.study_output import StudyPlaces, deliver_study
from touchline.schemas.errors import SpecError

STEM = "reality-study"


def reality_study(logs: Sequence[Path], seeds: int, places: StudyPlaces, *, as_json: bool) -> None:
    """Run and print the study; exit code 1 if a statistic is off and chance does not explain it.

    Raises:
        SpecError: There are no logs.
    """
    from touchline_research.reality.reality_study import run_reality_study

    if not logs:
        remedy = "name sessions, such as those that `touchline import` makes"
        raise SpecError("command line", "LOGS", "is missing", remedy)
    with progress_bar("Study") as advance:
        tables = run_reality_study(logs, seeds, lambda what, done: advance(done, what))
    deliver_study(tables, lambda _: (), places, STEM, as_json=as_json)
