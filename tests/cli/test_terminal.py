"""Nothing that comes from a file or the bus commands the terminal."""

import json

import pytest

from touchline.cli import display
from touchline.recordings.recorder import Recorder
from touchline.schemas.catalogue import parse_template
from touchline.schemas.cdr import encode
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import PaintMarks, String

#: The clipboard, a cleared screen, the same in C1 controls, a title, text turned round, and rich's own markup.
EVIL = "\x1b]52;c;ZXZpbA==\x07A\x1b[2JB\x9b31mC\x9d0;x\x9cD\u202eE\x00F[red]G[/red][link=http://x]H[/link]"
SEGMENT = {"id": "a", "line": {"start": [0, 0], "end": [5, 0]}}


def assert_harmless(*shown):
    for text in shown:
        assert not [char for char in text if (ord(char) < 32 and char not in "\t\n") or 127 <= ord(char) < 160]
        assert "\u202e" not in text


@pytest.mark.parametrize("field", ["name", "title", "source", "segments[0].id", "segments[0].label"])
@pytest.mark.parametrize("text", ["a\x1b[2J", "a\nb", "a\x9b", "a\u202eb", "a\x7f"])
def test_a_templates_texts_have_no_control_characters(field, text):
    data = {"name": "t", "segments": [dict(SEGMENT)]}
    (data["segments"][0] if "." in field else data)[field.rpartition(".")[2]] = text
    with pytest.raises(SpecError, match="has the control character U") as refusal:
        parse_template(json.dumps(data))
    assert f"template: {field} " in str(refusal.value)
    assert parse_template(json.dumps(data), recorded=True).segments


def test_names_in_any_script_are_taken():
    for name in ("Spielfeld Süd", "ملعب", "\u092e\u0948\u0926\u093e\u0928\u200d", "\u26bd\ufe0f"):
        assert parse_template(json.dumps({"name": name, "segments": [SEGMENT]})).name == name


def test_errors_events_and_figures_are_plain(touchline, tmp_path, capsys):
    path = tmp_path / "evil.json"
    path.write_text(json.dumps({EVIL: 1, "name": EVIL, "segments": [SEGMENT]}))
    for arguments in (
        ("plan", str(path)),
        ("plan", EVIL),
        ("picture", f"{EVIL}.mcap", "--out", str(tmp_path / "x.svg")),
    ):
        code, out, err = touchline(*arguments)
        assert code == 2
        assert_harmless(out, err)
    display.print_event(2, EVIL)
    display.say(f"{EVIL}\n{EVIL}")
    display.print_figures(EVIL, {EVIL: EVIL})
    shown = capsys.readouterr()
    assert_harmless(shown.out, shown.err)
    assert shown.err.count("ABCDEF[red]G[/red]") == 3
    assert "ABCDEF[red]G[/red]" in shown.out


def test_recordings_are_compared_and_drawn_in_plain_text(touchline, tmp_path):
    for name, second in (("left", 1.0), ("right", 2.0)):
        recorder = Recorder(tmp_path / f"{name}.mcap", namespaces=(EVIL.replace("/", ""),))
        recorder.write(
            "template", encode(String(data=json.dumps({"name": EVIL, "title": EVIL, "segments": [SEGMENT]}))), 1
        )
        recorder.write("truth/paint", encode(PaintMarks(segment_id=EVIL, x_m=[0.0, second], y_m=[0.0, 0.0])), 1)
        recorder.finish()
    left, right = str(tmp_path / "left.mcap"), str(tmp_path / "right.mcap")
    code, out, err = touchline("compare", left, right)
    assert code == 1 and "paint" in out
    assert_harmless(out, err)
    code, out, err = touchline("picture", left, "--out", str(tmp_path / "x.svg"))
    assert code == 0
    assert_harmless(out, err)
