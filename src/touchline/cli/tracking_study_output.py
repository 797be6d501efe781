"""``touchline study tracking``: cubic paths, speed laws and trackers, as tables, Markdown or JSON, and pictures."""

from touchline.cli.display import progress_bar
from touchline.cli.study_output import StudyPlaces, deliver_study

STEM = "tracking-study"


def tracking_study(places: StudyPlaces, *, quick: bool, as_json: bool) -> None:
    """Run and print the study; exit code 1 if a requirement is missed."""
    from touchline_research.tracking.tracking_figures import save_pictures
    from touchline_research.tracking.tracking_study import FULL, QUICK, run_tracking_study

    with progress_bar("Study") as advance:
        study = run_tracking_study(QUICK if quick else FULL, lambda what, done: advance(done, what))
    deliver_study(study.tables, lambda folder: save_pictures(study.domains, folder), places, STEM, as_json=as_json)
