"""``touchline study network``: teams by the study's rules and by ours, as tables, Markdown or JSON, and pictures."""

from touchline.cli.display import progress_bar
from touchline.cli.garbage import without_collecting
from touchline.cli.study_output import StudyPlaces, deliver_study

STEM = "network-study"


def network_study(seeds: int, places: StudyPlaces, *, quick: bool, as_json: bool) -> None:
    """Run and print the study; exit code 1 if a requirement is missed."""
    from touchline_research.network.network_figures import save_team_pictures
    from touchline_research.network.network_study import FULL, QUICK, run_network_study

    with progress_bar("Study") as advance:
        counts = QUICK if quick else FULL._replace(seeds=seeds)
        with without_collecting():
            study = run_network_study(counts, lambda what, done: advance(done, what))
    deliver_study(
        study.tables,
        lambda folder: save_team_pictures(study.deployed, folder, study.compared),
        places,
        STEM,
        as_json=as_json,
    )
