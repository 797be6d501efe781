"""Bad specifications are refused with the file, the field, the problem and the remedy."""

import json
from pathlib import Path

import pytest

from benchmarks._data_sheets import data_sheets
from touchline.schemas.catalogue import load_template, parse_template
from touchline.schemas.errors import SpecError
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.spec import MAX_KEYS, MAX_SPEC_BYTES, Spec, parse
from touchline.schemas.vehicles import Vehicle

LINE = {"id": "a", "line": {"start": [0, 0], "end": [1, 0]}}


def template(*segments: object, **fields: object) -> str:
    return json.dumps({"name": "t", "segments": list(segments), **fields})


@pytest.mark.parametrize(
    ("text", "field", "says"),
    [
        ("{", "line 1, column 2", "not JSON"),
        ("[]", "", "is a JSON array"),
        ("{}", "name", "is missing"),
        (template(), "", "give at least one of segments and areas"),
        (template(LINE).replace('"t"', '"' + "n" * 101 + '"'), "name", "has 101 characters; give at most 100"),
        (template({"id": "a", "line": {"start": [0, 0, 0], "end": [1, 0]}}), "segments[0].line.start", "has 3 items"),
        (template({"id": "a", "line": {"start": "0, 0", "end": [1, 0]}}), "segments[0].line.start", "give a list"),
        (template(LINE, line_width_m=12), "line_width_m", "is 12; give at most 0.3 m (in metres, not cm or mm)"),
        (template(LINE, line_width_m=-0.1), "line_width_m", "is -0.1; give at least 0.02 m"),
        (template(LINE, placement={"rotation_deg": "north"}), "placement.rotation_deg", "is 'north'; give a number"),
        (template(LINE, LINE), "segments", 'share the id "a"'),
        (template(LINE, unit="m"), "unit", "not a known field"),
        (template(LINE, boundary=[[0, 0]]), "boundary", 'is a JSON array; give an object {"corners": …}'),
        (template({"id": "a"}), "segments[0]", "exactly one of line and arc"),
        (template({"id": "a", "line": {"start": [0, 0], "end": [0, 0]}}), "segments[0].line", "at least 0.01 m"),
        (template({"id": "a", "line": {"start": [0, 0], "end": [float("nan"), 0]}}), "segments[0].line.end[0]", "nan"),
        (template({"id": "a", "line": {"start": [0, 0], "end": [float("inf"), 0]}}), "segments[0].line.end[0]", "inf"),
        (
            template({"id": "a", "line": {"start": [0, 0], "end": [1e9, 0]}}),
            "segments[0].line.end[0]",
            "at most 10000 m (in metres",
        ),
        (template({"id": "a", "line": {"start": [0, 0], "end": ["x", 0]}}), "segments[0].line.end[0]", "'x'"),
        (
            template({"id": "a", "arc": {"start": [0, 0], "center": [0, 0], "sweep_angle": 1}}),
            "segments[0].arc",
            "from its center",
        ),
        (
            template({"id": "a", "arc": {"start": [1, 0], "center": [0, 0], "sweep_angle": 7}}),
            "segments[0].arc.sweep_angle",
            "is 7; give at most 6.283185308 rad (in radians, not degrees: 0.122173)",
        ),
        (
            template({"id": "a", "arc": {"start": [1, 0], "center": [0, 0], "sweep_angle": 0}}),
            "segments[0].arc",
            "enlarge sweep_angle",
        ),
    ],
)
def test_bad_template(text: str, field: str, says: str):
    with pytest.raises(SpecError) as caught:
        parse_template(text, "pitch.json")
    assert caught.value.field == field
    assert caught.value.source == "pitch.json"
    assert says in str(caught.value)


@pytest.mark.parametrize(
    ("kind", "text", "field", "says"),
    [
        (Scenario, {"seed": 1.5}, "seed", "is 1.5; give a whole number"),
        (Scenario, {"seed": 2**63}, "seed", "give at most 9223372036854775807"),
        (OnboardConfig, {"follower": "lqr"}, "follower", "is 'lqr'; give 'mpc', 'pure-pursuit', 'pursuit-lanes'"),
        (OnboardConfig, {"link_timeout_s": 0}, "link_timeout_s", "is 0; give more than 0 s"),
        (OnboardConfig, {"gnss": {"rate_hz": 3}}, "gnss.rate_hz", "is 3"),
        (OnboardConfig, {"gnss": {"hold_s": 3}}, "gnss.hold_s", "is not a known field"),
        (OnboardConfig, {"seed": 3}, "seed", "is not a known field"),
    ],
)
def test_bad_scenario_or_configuration(kind: type[Spec], text: dict[str, object], field: str, says: str):
    with pytest.raises(SpecError) as caught:
        parse(kind, json.dumps(text), "windy.json")
    assert caught.value.field == field
    assert says in str(caught.value)


@pytest.mark.parametrize("name", ["follower", "fence", "link_timeout_s"])
def test_what_a_scenario_had_of_the_computer_is_sent_there(name: str):
    with pytest.raises(SpecError, match=f"{name} is of the robot's own computer: move it to a file for --onboard"):
        parse(Scenario, json.dumps({"seed": 2, name: 1}), "windy.json")


def test_the_setup_of_an_older_recording_is_read():
    fence = {"margin_m": 3.0}
    older = {"scenario": {"seed": 4, "follower": "pure-pursuit", "fence": fence, "link_timeout_s": 1.0}}
    setup = parse(Setup, json.dumps(older), "recorded")
    assert (setup.scenario.seed, setup.onboard.follower, setup.onboard.fence.margin_m) == (4, "pure-pursuit", 3.0)
    assert setup.onboard.link_timeout_s == 1.0


def test_data_sheets_say_by_default_what_the_world_is_by_default():
    sheets, default = data_sheets(Scenario()).model_dump(), OnboardConfig().model_dump()
    doubts = {"antenna_sigma_m", "stamp_offset_sigma_s", "gyro_scale_sigma", "crab_rad", "side_slip_m_rtm"}
    for name, sheet in sheets.items():
        told = default[name]
        assert sheet == told or {key: sheet[key] for key in sheet.keys() - doubts} == {
            key: told[key] for key in told.keys() - doubts
        }


def test_a_file_may_begin_with_a_byte_order_mark(tmp_path: Path):
    path = tmp_path / "x.json"
    path.write_text(template(LINE), encoding="utf-8-sig")
    assert load_template(path).length_m == 1.0


def test_good_template():
    drawing = parse_template(template(LINE, line_width_m=0.1))
    assert drawing.length_m == 1.0
    assert drawing.line_width_m == 0.1


def test_missing_file_names_the_shipped_ones():
    with pytest.raises(SpecError, match="soccer-11"):
        load_template("no-such-template")


def test_binary_file(tmp_path: Path):
    path = tmp_path / "x.json"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SpecError, match="not UTF-8"):
        load_template(path)


def test_folder_is_not_a_file(tmp_path: Path):
    with pytest.raises(SpecError, match="cannot be read"):
        load_template(tmp_path)


def test_noise_none_silences_everything_but_latency():
    silent = Scenario(noise="none").effective()
    assert silent.gnss.latency_s == Scenario().gnss.latency_s
    assert not silent.encoder.quantised
    noises = [silent.gnss.white_m, silent.gnss.gauss_markov_1_m, silent.imu.gyro_turn_on_bias_radps]
    noises += [silent.magnetometer.bias_rad, silent.drive.slip_relative, silent.drive.wheel_radius_relative]
    assert noises == [0.0] * len(noises)
    assert Scenario().effective() == Scenario()


def test_a_vehicle_that_cannot_keep_its_speed_is_refused():
    with pytest.raises(SpecError, match=r"transit_speed_mps is 2\.5; give at most 2 m/s"):
        parse(Vehicle, '{"drive": {"transit_speed_mps": 2.5}}', "robot.json")


SEGMENT = '{"id": "%d", "line": {"start": [0, 0], "end": [5, 0]}}'


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{" + ",".join(f'"k{i}": 1' for i in range(100_000)) + ', "k5": 2}', "key 'k5' is given twice"),
        ("{" + ",".join(f'"k{i}": 1' for i in range(100_000)) + "}", f"give at most {MAX_KEYS:,}"),
        ('{"name": "' + "x" * MAX_SPEC_BYTES + '"}', f"give at most {MAX_SPEC_BYTES:,}"),
        ('{"name": ' + "[" * 100_000 + "]" * 100_000 + "}", "nested too deeply"),
        ('{"name": ' + "1" * 100_000 + "}", "thousands of digits"),
        ('{"name": "t", "line_width_m": 1e999}', "is inf"),
    ],
    ids=["repeated", "many keys", "large", "deep", "digits", "infinite"],
)
def test_what_is_too_much_is_refused_by_name(text: str, says: str) -> None:
    with pytest.raises(SpecError, match=says):
        parse_template(text)
