"""The whole study, run quickly, and its command."""

import csv
import json
import re
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.command import app
from touchline_research.run import Study, run_study, save_study

ROW_11 = [*(f"11.{k}" for k in range(1, 13)), "11, too fast"]
ROW_11 += ["11a", "11b", "11c", "11a, by hand", "11b, by hand", "11c, by hand"]
ROW_12 = ["12a", "12b", "12c", "12a, by hand", "12b, by hand", "12c, by hand", "12, pairs"]
ROW_12[3:3] = ["12 and 13, ideal"]
ROW_12[7:7] = ["12 and 13, ideal, by hand"]
#: The reference's rows, in its order; several have several targets.
NUMBERS = ["1", "2", "3", "4", "5", "6, 7", "8", "9", "10", *ROW_11, *ROW_12, "13", "14", "14, fine"]
#: For information only.
UNJUDGED = {"9", "10", "11, too fast", "11c, by hand", "12, pairs"}
DOCS = Path(__file__).parents[2] / "docs" / "measurements" / "study.md"
#: Rows whose figures depend on neither --quick nor --pairs.
PINNED = {*ROW_11, "12a", "12b", "12c", "12 and 13, ideal", "13", "14", "14, fine"}


# With cold kernels on a busy machine the first use takes a minute or two.
pytestmark = [pytest.mark.full, pytest.mark.timeout(400), pytest.mark.xdist_group("study")]  # one worker measures it


@pytest.fixture(scope="module")
def study() -> Study:
    said: dict[str, float] = {}
    result = run_study(20, True, lambda what, done: said.update({what: done}))
    assert len(said) > 5
    assert all(0.0 <= done <= 1.0 for done in said.values())
    return result


def test_every_row_of_the_reference_is_there(study: Study) -> None:
    assert [row.number for row in study.rows] == NUMBERS
    assert {row.number for row in study.rows if row.met is False} == set()
    assert {row.number for row in study.rows if row.met is None} == UNJUDGED
    for row in study.rows:
        assert all(row.results)
        assert (row.met is None) == (not row.must)


def figures_of(cells: Iterable[str]) -> list[float]:
    return [float(figure) for cell in cells for figure in re.findall(r"[+-]?\d+(?:\.\d+)?", cell)]


def test_the_docs_say_what_is_measured(study: Study) -> None:
    """Every figure of these rows, and of the causes: seconds and peaks within 3 %, small ones within 0.3."""
    written = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in DOCS.read_text(encoding="utf-8").splitlines()
        if line.startswith("| ")
    ]
    by_first = {cells[0]: cells[1:] for cells in written}
    for row in study.rows:
        if row.number in PINNED:
            assert figures_of(by_first[row.number][:-1]) == pytest.approx(
                figures_of(row.cells[1:-1]), rel=0.03, abs=0.3
            )
    for cause in study.causes:
        said, measured = by_first[cause.exchanged], cause.cells[1:]
        assert figures_of(said) == pytest.approx(figures_of(measured), rel=0.03, abs=0.3)


def test_ours_is_faster_like_for_like_with_any_order_speed_and_limits(study: Study) -> None:
    rows = [row for row in study.rows if row.number.startswith("11.")]
    assert len(rows) == 12
    for order in ("Law 1", "by hand", "our order"):
        assert sum(order in row.requirement for row in rows) == 4
    for row in rows:
        assert row.met
        assert row.figures["ours_kept"]
        assert float(row.figures["ours_share"] or 0.0) < -1e-3
        assert int(row.figures["dpp_steps"] or 0) > 100


def test_the_causes_lead_from_dpp_to_ours(study: Study) -> None:
    """From DPP as the study drives it to ours in its own order, without a gap."""
    figures = {row.number: row.figures for row in study.rows}
    assert len(study.causes) == 4
    assert study.causes[0].before_s == pytest.approx(figures["11a"]["dpp_s"], abs=1e-6)
    assert study.causes[-1].after_s == pytest.approx(figures["11c"]["ours_s"], abs=1e-3)
    for cause, following in pairwise(study.causes):
        assert cause.after_s == following.before_s
    whole = study.causes[-1].after_s / study.causes[0].before_s - 1.0
    assert sum(cause.share for cause in study.causes) == pytest.approx(whole)
    assert all(cause.share < 0.0 for cause in study.causes)


def test_what_is_saved_can_be_read(study: Study, tmp_path: Path) -> None:
    files = save_study(study, tmp_path / "new" / "folder")
    assert sorted(path.suffix for path in files) == [".csv", ".json", ".md", ".svg", ".svg", ".svg"]
    saved = json.loads((tmp_path / "new" / "folder" / "study.json").read_text())
    assert len(saved["causes"]) == 4
    rows = saved["rows"]
    assert len(rows) == len(NUMBERS)
    row = next(row for row in rows if row["row"] == "11a")
    assert row["figures"]["ours_s"] < row["figures"]["dpp_s"] < row["figures"]["study_ccd_s"]
    with (tmp_path / "new" / "folder" / "study.csv").open() as file:
        assert len(list(csv.reader(file))) == len(NUMBERS) + 1


def test_the_command_prints_the_rows_and_says_whether_all_are_met(
    study: Study, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("touchline_research.run.run_study", lambda pairs, quick, progress: study)
    result = CliRunner().invoke(app, ["study", "--quick", "--json"])
    assert result.exit_code == (1 if any(row.met is False for row in study.rows) else 0)
    assert len(json.loads(result.stdout)["rows"]) == len(NUMBERS)
    printed = CliRunner().invoke(app, ["study", "--out", str(tmp_path)], env={"COLUMNS": "200"})
    assert "ours must" in printed.stdout
    assert (tmp_path / "study.md").exists()


def test_plots_of_plans_by_the_command(tmp_path: Path) -> None:
    plot, wheels = tmp_path / "plan.svg", tmp_path / "wheels.svg"
    arguments = ["plan", "study-square", "--plot", str(plot), "--colour", "curvature", "--plot-wheels", str(wheels)]
    assert CliRunner().invoke(app, arguments).exit_code == 0
    assert plot.exists()
    assert wheels.exists()
    refused = CliRunner().invoke(app, ["plan", "study-square", "--plot-wheels", "wheels.gif"])
    assert "--plot-wheels" in str(refused.exception)
