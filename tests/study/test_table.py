"""The study's table: its machine-readable forms, and rows whose figures must hold."""

import csv
import io
import json

import pytest

from touchline.schemas.catalogue import load_template
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan
from touchline.services.planner.plots.actuator_series import actuator_series
from touchline_research import continuity
from touchline_research.driven_template import DPP, OURS, STUDY_CCD
from touchline_research.pitch import Pitch, length_rows
from touchline_research.table import HEADINGS, Cause, Row, as_csv, as_json, as_markdown

ROWS = [
    Row("1", "what", ("a, b", "c", "d"), "must", True, {"x": 1.5, "n": None}, "a note"),
    Row("2", "how", ("e", "f", "g"), "", None),
    Row("3", "why", ("h", "i", "j"), "all", False),
]

CAUSES = [Cause("order", 8.0, 6.0, 8.0), Cause("speed", 6.0, 4.0, 8.0)]


@pytest.fixture(scope="module")
def pitch() -> Pitch:
    return Pitch(load_template("soccer-11"))


@pytest.fixture(scope="module")
def square() -> Template:
    return load_template("study-square")


def test_csv_and_json_hold_every_row() -> None:
    read = list(csv.reader(io.StringIO(as_csv(ROWS))))
    assert tuple(read[0]) == HEADINGS
    assert [row[0] for row in read[1:]] == ["1", "2", "3"]
    assert [row[-1] for row in read[1:]] == ["pass", "–", "FAIL"]
    whole = json.loads(as_json(ROWS, CAUSES))
    assert whole["causes"][1] == {"exchanged": "speed", "before_s": 6.0, "after_s": 4.0, "first_s": 8.0}
    rows = whole["rows"]
    assert rows[0]["figures"] == {"x": 1.5, "n": None}
    assert [row["met"] for row in rows] == [True, None, False]
    assert rows[0]["study CCD"] == "c"


def test_markdown_is_a_table_with_notes() -> None:
    lines = as_markdown(ROWS, CAUSES).splitlines()
    assert lines[2:5] == [
        "| order | 8.0 s | 6.0 s | -2.0 s | -25.0% |",
        "| speed | 6.0 s | 4.0 s | -2.0 s | -25.0% |",
        "| all together | 8.0 s | 4.0 s | -4.0 s | -50.0% |",
    ]
    assert all(line.count("|") == len(HEADINGS) + 1 for line in lines[6:11])
    assert lines[-1] == "- **1**: a note"


def test_lengths_meet_their_targets(pitch: Pitch) -> None:
    rows = length_rows(pitch)
    assert [row.number for row in rows] == ["12a", "12b", "12c", "12 and 13, ideal"]
    assert all(row.met for row in rows)
    assert pitch.longer(OURS, 7.0, DPP) < 0.0 < pitch.longer(STUDY_CCD, 7.0, DPP)


def test_every_transition_between_lines_and_arcs(pitch: Pitch) -> None:
    assert continuity.joint_row(3).met
    assert pitch.drive(OURS).continuous_transitions() == (26, 26)
    assert pitch.drive(STUDY_CCD).continuous_transitions()[0] == 26
    assert pitch.drive(STUDY_CCD).continuous_transitions()[1] < 26
    assert pitch.drive(DPP).continuous_transitions()[1] == 0


def test_row_1_tells_what_fails() -> None:
    close = {
        "name": "close",
        "segments": [
            {"id": "a", "line": {"start": [0, 0], "end": [1, 0]}},
            {"id": "b", "line": {"start": [1.05, 0.001], "end": [2, 0.1]}},
        ],
    }
    row = continuity.template_row({"close": Template.model_validate(close)})
    assert row.results == ("1 of 1", "0 of 1", "1 of 1")
    assert row.met
    assert "study CCD on close" in row.note


def test_a_weaker_robot_breaks_its_limits(square: Template) -> None:
    planned = plan(square, Vehicle(), PlanOptions(order="given", forward_only=True))
    series = actuator_series(planned, 0.01)
    assert series.violations(Vehicle().changed(drive={"max_wheel_acceleration_radps2": 5.0})) > 0
    assert series.violations(Vehicle().changed(drive={"max_wheel_speed_radps": 9.0})) > 0
