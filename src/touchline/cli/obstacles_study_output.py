"""``touchline study obstacles``: protection and ways to goals, as tables, Markdown or JSON, and pictures."""

from touchline.cli.display import progress_bar
from touchline.cli.study_output import StudyPlaces, deliver_study

STEM = "obstacles-study"


def obstacles_study(places: StudyPlaces, *, quick: bool, as_json: bool) -> None:
    """Run and print the study; exit code 1 if a requirement is missed."""
    from touchline_research.obstacles.obstacles_figures import save_obstacle_pictures
    from touchline_research.obstacles.obstacles_study import FULL, QUICK, run_obstacles_study

    with progress_bar("Study") as advance:
        study = run_obstacles_study(QUICK if quick else FULL, lambda what, done: advance(done, what))
    deliver_study(
        study.tables,
        lambda folder: save_obstacle_pictures(study.lines, study.trials, folder),
        places,
        STEM,
        as_json=as_json,
    )
