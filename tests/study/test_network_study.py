"""The study of a network of robots, on few of them, its pictures and its command."""

import json
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from typer.testing import CliRunner

from tests.command import app
from touchline_research.network import deployments, network_study, swaps
from touchline_research.network.deployments import AskedSpread, deployment_table
from touchline_research.network.moving_picture import BODY, TOUCHING, moving_picture
from touchline_research.network.network_study import NetworkStudy, TeamCounts, run_network_study
from touchline_research.network.team_trials import BEARING, OURS, TeamRecord

# With cold kernels on a busy machine the first use takes a minute or two.
pytestmark = [pytest.mark.full, pytest.mark.timeout(400), pytest.mark.xdist_group("network study")]

DEPLOYED, SWAPPED, SPEEDS = range(3)
SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def study() -> NetworkStudy:
    said: dict[str, float] = {}
    result = run_network_study(
        TeamCounts((10,), (4,), 1, 40, 18.0, 4, 0.1), lambda what, done: said.update({what: done})
    )
    assert len(said) == 1 + len(result.deployed) + 2 + len(result.compared)
    assert all(before <= after < 1.0 for before, after in pairwise(said.values()))
    return result


def of_rules(study: NetworkStudy, rules: object) -> TeamRecord:
    return next(record for record in study.deployed if record.trial.rules == rules)


def test_ours_reaches_all_that_is_asked_and_the_studys_robots_collide(study: NetworkStudy) -> None:
    assert not any(table.missed for table in study.tables)
    bearing, free, ours = study.tables[DEPLOYED].rows
    assert bearing.met and ours.met and free.met is None
    assert bearing.figures["contacts"] > 10 > ours.figures["contacts"] == 0
    assert bearing.figures["of_squares_worst"] > 1.2 > ours.figures["of_squares_worst"]
    theirs, ours = study.tables[SWAPPED].rows
    assert theirs.met is None and ours.met
    assert theirs.figures["contacts"] > 0 == ours.figures["contacts"] == ours.figures["missing"]
    assert all(len(row.texts) == len(table.headings) for table in study.tables for row in table.rows)


@pytest.mark.parametrize(
    ("name", "value", "missed"),
    [
        ("ASKED", {10: AskedSpread(5.0, 3.5)}, OURS),
        ("ASKED", {10: AskedSpread(20.0, 1.0)}, OURS),
        ("OF_POINTS", 0.9, OURS),
        ("OFF_BODIES_M", 0.2, OURS),
        ("STUDY_CONTACTS", 10_000, BEARING),
    ],
)
def test_a_verdict_can_fail(
    name: str, value: object, missed: object, study: NetworkStudy, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(deployments, name, value)
    table = deployment_table(study.deployed)
    assert [row.cells[0] for row in table.rows if row.met is False] == [missed.name]  # type: ignore[attr-defined]


def test_cells_that_let_robots_touch_fail(study: NetworkStudy) -> None:
    ours, theirs = of_rules(study, OURS), of_rules(study, BEARING)
    worse = ours._replace(figures=ours.figures | {"contacts": 1})
    assert deployment_table([worse]).missed
    assert swaps.swap_table([_swapped(ours, 44.0, 10)]).missed is False
    for arrived_s, arrived in ((46.0, 10), (None, 9)):
        assert swaps.swap_table([_swapped(ours, arrived_s, arrived)]).missed
    assert not swaps.swap_table([_swapped(theirs, None, 0)]).missed


def _swapped(record: TeamRecord, arrived_s: float | None, arrived: int) -> TeamRecord:
    return record._replace(figures=record.figures | {"goals": {"all_arrived_s": arrived_s, "arrived": arrived}})


@pytest.mark.parametrize("met", [True, False])
def test_a_missed_row_makes_the_exit_code(
    met: bool, study: NetworkStudy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[TeamCounts] = []

    def run(counts: TeamCounts, progress: object) -> NetworkStudy:
        asked.append(counts)
        return study

    monkeypatch.setattr(deployments, "OF_POINTS", 1.015 if met else 0.9)
    table = deployment_table(study.deployed)
    monkeypatch.setattr(network_study, "run_network_study", run)
    study = NetworkStudy((table,), study.deployed, study.compared)
    out, plots = tmp_path / "tables", tmp_path / "plots"
    told = ["study", "network", "--json", "--seeds", "2", "--out", str(out)]
    result = CliRunner().invoke(app, [*told, "--plots", str(plots)] if met else told)
    assert result.exit_code == (0 if met else 1)
    assert asked[0].seeds == 2 and asked[0].deployed == (10, 20, 50)
    assert [each["met"] for each in json.loads(result.stdout)[0]["rows"]] == [True, None, met]
    assert (out / "network-study.md").read_text().startswith("## Spreading")
    pictures = ["network-algorithms.svg", "network-cost.png", "network-moving.svg", "network-ways.png"]
    assert sorted(path.name for path in plots.glob("*")) == (pictures if met else [])


def test_the_moving_picture_shows_every_body_and_who_touches(study: NetworkStudy) -> None:
    pair = [of_rules(study, BEARING), of_rules(study, OURS)]
    text = moving_picture(pair)
    assert len(text.encode()) < 300_000
    root = ET.fromstring(text)
    discs = root.findall(f"{SVG}circle")
    assert len(discs) == 2 * 10
    tracks = [disc.find(f"{SVG}animateTransform").get("values").split(";") for disc in discs]  # type: ignore[union-attr]
    assert {len(track) for track in tracks} == {len(pair[0].trace.times_s)}
    red = [disc.find(f"{SVG}animate") for disc in discs]
    assert all(each is None for each in red[10:])
    switched = [each.get("values").split(";") for each in red[:10] if each is not None]  # type: ignore[union-attr]
    assert len(switched) >= 2 and all(set(colours) == {BODY, TOUCHING} for colours in switched)
    assert f"{pair[0].trace.contacts[-1]} contacts" in [each.text for each in root.findall(f"{SVG}text")]
