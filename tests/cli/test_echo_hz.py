"""``touchline echo`` and ``hz`` on recordings and on the bus."""

import json
import threading
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.bridge.foreign import foreign
from tests.bridge.said import messages, record
from tests.command import app
from tests.system.commands import touchline_here
from touchline.bus import Bus, BusConfig
from touchline.schemas import topics
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import Clock, Time


def run(*arguments: str | Path) -> str:
    result = CliRunner().invoke(app, [str(each) for each in arguments], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.stdout


@pytest.fixture
def session(tmp_path: Path) -> Path:
    return record(tmp_path / "a.mcap", messages(200)).finish().path


def test_a_field_of_a_stretch_of_time(session: Path) -> None:
    shown = run("echo", session, "imu/data_raw", "--field", "angular_velocity.z", "--from", "0.5", "--to", "0.52")
    assert shown.splitlines() == ["0.500000  25.0 rad/s", "0.510000  25.5 rad/s", "0.520000  26.0 rad/s"]


def test_messages_as_json_lines_and_as_text(session: Path) -> None:
    lines = run("echo", session, "/tt2/truth/paint", "--json", "--count", "2").splitlines()
    assert [json.loads(line)["message"]["x_m"] for line in lines] == [[0.0, 0.0], [0.0, 10.0]]
    assert json.loads(lines[1])["time_s"] == 0.1
    text = run("echo", session, "truth/paint", "--count", "1")
    assert "/tt2/truth/paint at 0.000000 s" in text and "  y_m: [1.0, 2.0] m" in text


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nope"], "has no topic nope; `touchline info` lists them"),
        (["clock", "--field", "clock.hours"], "has no hours; give one of sec, nanosec"),
        (["clock", "imu"], "give RECORDING TOPIC"),
    ],
)
def test_what_is_not_there_is_said(session: Path, arguments: list[str], said: str) -> None:
    result = CliRunner().invoke(app, ["echo", str(session), *arguments])
    assert isinstance(result.exception, TouchlineError) and said in str(result.exception)


def test_what_nothing_here_decodes_is_told(tmp_path: Path) -> None:
    path = foreign(tmp_path / "a.mcap", [("/p", 5, b"123")], encoding="protobuf", schema_encoding="protobuf")
    result = CliRunner().invoke(app, ["echo", str(path), "/p"])
    assert isinstance(result.exception, TouchlineError) and "in protobuf, which is not decoded" in str(result.exception)


def test_rates_and_jitter(tmp_path: Path) -> None:
    times_s = [0.0, 0.1, 0.2, 0.3, 0.4, 0.9]
    path = foreign(tmp_path / "a.mcap", [("/a", 10**18 + int(at * 1e9), b"") for at in times_s])
    rate = json.loads(run("hz", path, "--json"))["/a"]
    assert rate["messages"] == 6 and rate["rate_hz"] == pytest.approx(5 / 0.9)
    assert (rate["gap_p50_ms"], rate["gap_max_ms"]) == (pytest.approx(100.0), pytest.approx(500.0))
    assert rate["gap_p95_ms"] == pytest.approx(420.0) and rate["jitter_ms"] == pytest.approx(160.0)


def test_a_table_of_the_topics_asked_for(session: Path) -> None:
    shown = run("hz", session, "imu/data_raw")
    assert "/tt2/imu/data_raw" in shown and "/tt2/clock" not in shown and "100" in shown


def test_a_robot_on_the_bus(bus_config: BusConfig) -> None:
    over = threading.Event()
    with Bus.open(topics.TELEMETRY, bus_config) as bus:
        clock = bus.publisher(topics.CLOCK)

        def publish() -> None:
            while not over.wait(0.02):
                clock.send(Clock(clock=Time(sec=7)))

        def listen(*command: str) -> str:
            done = touchline_here(*command, "--json", "--robot", bus.namespace, config=bus_config)
            assert done.returncode == 0, done.stderr
            return done.stdout

        publisher = threading.Thread(target=publish)
        publisher.start()
        try:
            echoed = listen("echo", "clock", "--count", "3", "--seconds", "60").splitlines()
            rates = json.loads(listen("hz", "clock", "--seconds", "2"))
        finally:
            over.set()
            publisher.join()
    assert [json.loads(each)["message"]["clock"]["sec"] for each in echoed] == [7, 7, 7]
    assert rates[f"/{bus.namespace}/clock"]["messages"] > 2
