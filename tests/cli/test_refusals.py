"""The impossible is refused in a line, before any work; work that was done is reported whatever else goes wrong."""

import io
import json
import sys
from pathlib import Path

import pytest

from touchline.recordings.writing import write_text
from touchline.schemas.errors import SpecError
from touchline.schemas.roles import Role
from touchline.security.authority import CertificateAuthority

SEGMENT = {"id": "a", "line": {"start": [0, 0], "end": [5, 0]}}
TWICE = {"id": "bad", "line": {"start": [0, 2], "end": [1, 2]}}
BAD = {
    "not JSON": ("{", "is not JSON"),
    "empty": ('{"name": "t", "segments": []}', "segments"),
    "NaN": ('{"name": "t", "segments": [{"id": "a", "line": {"start": [0, 0], "end": [NaN, 0]}}]}', "end[0] is nan"),
    "zero length": (
        '{"name": "t", "segments": [{"id": "a", "line": {"start": [0, 0], "end": [0, 0]}}]}',
        "at least 0.01 m apart",
    ),
    "unknown field": (json.dumps({"name": "t", "segments": [SEGMENT], "speed": 3}), "speed is not a known field"),
    "same id twice": (json.dumps({"name": "t", "segments": [SEGMENT, TWICE, TWICE]}), 'share the id "bad"'),
}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("run", "study-square", "--record", "/no/such/folder/x.mcap"), "x.mcap cannot be written (there is no such"),
        (("simulate", "study-square", "--report", "/"), "is a folder"),
        (("plan", "study-square", "--plot-wheels", "/no/such/folder/x.svg"), "there is no such folder"),
        (("sweep", "study-square", "--csv", "/no/such/folder/x.csv"), "there is no such folder"),
        (("picture", "/no/such.mcap", "--out", "x.gif"), "--out ends in '.gif'"),
        (("simulate", "study-square", "--seed", str(2**63)), "--seed"),
        (("up", "--speed", "fast"), "--speed"),
        (("simulate", "study-square", "--follower", "external"), "use `touchline run` or `up`"),
        (("sweep", "study-square", "--set", "follower=mpc,external"), "use `touchline run` or `up`"),
        (("sweep",), "SCENARIO|TEMPLATE is missing; give a template, a scenario file, or --goal X,Y[,HEADING]"),
        (("sweep", "--goal", "3"), "--goal is '3'; give it as in --goal 3,2,1.2"),
        (("sweep", "tennis", "--goal", "3,2"), "--goal is 3,2, and the template tennis is given, too; give one"),
        (("sweep", "--template", "tennis", "--goal", "-3,2"), "--goal is -3,2, and the template tennis is given, too"),
        (("tui",), "needs a terminal"),
        (("plan", "no-such"), "soccer-11"),
        (("plan", "study-square", "--kappa-max", "-1"), "--kappa-max"),
        (("plan", "study-square", "--plot", "x.bmp"), ".svg"),
        (("plan", "study-square", "--out", "/no/such/folder/x.json"), "cannot be written"),
        (("run", "study-square", "--speed", "fast"), "--speed"),
        (("run", "study-square", "--follower", "lqr"), "follower"),
        (("robot-sim", "--scenario", "/no/such.json"), "cannot be read"),
        (("replay", "/no/such.mcap"), "no/such.mcap"),
        (("fleet", "simulate", "--algorithm", "nobody"), "algorithm.use is 'nobody'"),
        (("fleet", "simulate", "--algorithm", "external"), "which is asked over the bus"),
    ],
)
def test_what_cannot_be_done_is_refused_at_once(arguments, says, touchline):
    code, out, err = touchline(*arguments)
    assert (code, out) == (2, "")
    assert says in " ".join(err.split())


@pytest.mark.parametrize(
    ("command", "says"),
    [
        (("run", "study-square"), "has no identities"),
        (("demo",), "has no identities"),
        (("run", "soccer-11", "--robots", "2"), "add --secure"),
        (("fleet", "run", "--robots", "2"), "add --secure"),
    ],
)
def test_an_identity_is_refused_by_what_would_start_an_open_system(command, says, tmp_path, monkeypatch, touchline):
    authority = CertificateAuthority.create(tmp_path / "keys")
    anna = authority.new_member(Role.OPERATOR, "anna")
    authority.issue([anna])
    monkeypatch.setenv("TOUCHLINE_IDENTITY", str(authority.folder_of(anna)))
    code, _, err = touchline(*command)
    assert code == 2
    assert says in " ".join(err.split())


# Both commands read templates with the same function: of `run` one is enough.
@pytest.mark.parametrize(("command", "bad"), [*(("plan", bad) for bad in BAD), ("run", "NaN")])
def test_a_bad_template_is_told_in_one_line(command, bad, touchline, tmp_path):
    text, says = BAD[bad]
    path = tmp_path / "field.json"
    path.write_text(text)
    code, _, err = touchline(command, str(path))
    assert code in (1, 2)
    assert says in err
    assert len(err.splitlines()) == 1


def test_parameters_are_for_shipped_templates(touchline, tmp_path):
    path = tmp_path / "field.json"
    path.write_text(json.dumps({"name": "t", "segments": [SEGMENT]}))
    _, _, err = touchline("plan", str(path), "--set", "length=3")
    assert "field.json has no parameters, so length cannot be set" in err


def test_figures_that_cannot_be_written_are_shown_all_the_same(touchline):
    code, out, err = touchline("plan", "study-square", "--json", "--report", "/dev/full")
    assert code == 2
    assert "/dev/full cannot be written (No space left on device)" in err
    assert json.loads(out)["segments"]["painted"] == 4


def test_a_report_that_finds_no_room_leaves_the_one_before(tmp_path, monkeypatch):
    report = tmp_path / "report.json"
    write_text("the one before", report)
    monkeypatch.setattr(Path, "replace", lambda self, target: Path("/dev/full").write_text("x"))
    with pytest.raises(SpecError, match="No space left"):
        write_text("another", report)
    assert [path.name for path in tmp_path.iterdir()] == ["report.json"]
    assert report.read_text() == "the one before"


def test_titles_are_shown_as_they_are_written(touchline, tmp_path):
    path = tmp_path / "field.json"
    path.write_text(json.dumps({"name": "t", "title": "Ground [north] \u26bd", "segments": [SEGMENT]}))
    _, out, _ = touchline("plan", str(path))
    assert "Plan of Ground [north] \u26bd" in out


def test_an_output_without_the_letters_gets_question_marks(touchline, monkeypatch):
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(io.BytesIO(), encoding="latin-1"))
    code, _, _ = touchline("templates")
    assert code == 0
    sys.stdout.flush()
    assert b"soccer-11" in sys.stdout.buffer.getvalue()


def test_a_name_in_the_list_can_be_copied_from_a_narrow_terminal(touchline, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert "american-football" in touchline("templates")[1]
