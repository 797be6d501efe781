"""The planner as a real process on a real bus: answers, progress, refusals, health, a clean end."""

import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

from touchline.bus import Bus, BusConfig
from touchline.bus.ports import free_port
from touchline.schemas import topics
from touchline.schemas.catalogue import parse_template, template_text
from touchline.schemas.messages import (
    DiagnosticStatus,
    GetDiagnosticsRequest,
    PlanOptions,
    PlanRequest,
    PlanResponse,
    Progress,
)
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan
from touchline.services.planner.service import RequestTally, Worker, condition

pytestmark = pytest.mark.xdist_group("planner service")  # by one worker, so that it is started once
ANSWER_S = 200.0
"""The first plan may wait for the kernels to be compiled."""
START = """
from touchline.bus import BusConfig
from touchline.services.planner.service import RequestTally, Worker, condition, run_service
run_service(BusConfig({!r}))
"""


@pytest.fixture(scope="module")
def config() -> BusConfig:
    return BusConfig(f"tcp/127.0.0.1:{free_port()}")


@pytest.fixture(scope="module")
def planner(config: BusConfig) -> "Iterator[subprocess.Popen[str]]":
    command = [sys.executable, "-c", START.format(config.endpoint)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        yield process
        process.kill()


@pytest.fixture(scope="module")
def bus(config: BusConfig, planner: object) -> Iterator[Bus]:
    with Bus.open("test", config) as bus:
        assert bus.wait_for({topics.PLANNER}, 100.0) == set()
        yield bus


def test_a_template_is_planned_with_progress(bus: Bus) -> None:
    inbox = bus.inbox([topics.PLANNER_PROGRESS])
    request = PlanRequest(request_id="pitch", template_json=template_text("study-square")[0])
    response = bus.call(topics.PLAN_SERVICE, request, ANSWER_S)
    assert response.success, response.message
    assert response.report.painted_segments == 4
    assert len(response.trajectory.path.segments) > 10
    said = [m for _, m in inbox.messages() if isinstance(m, Progress)]
    while not any(m.stage == "report" for m in said):
        said += [s.decode() for s in inbox.wait(60.0)]
    assert {m.request_id for m in said} == {"pitch"}
    assert any(m.stage == "order" and m.fraction == 1.0 for m in said)


def test_it_is_planned_for_the_vehicle_of_the_request(bus: Bus) -> None:
    square = template_text("study-square")[0]
    wide = Vehicle(name="wide", drive={"track_width_m": 0.8})

    def planned(name: str, vehicle_json: str) -> PlanResponse:
        request = PlanRequest(request_id=f"vehicle {name}", template_json=square, vehicle_json=vehicle_json)
        return bus.call(topics.PLAN_SERVICE, request, ANSWER_S)

    own, same, other = (
        planned("own", ""),
        planned("same", Vehicle().model_dump_json()),
        planned("wide", wide.model_dump_json()),
    )
    assert own.trajectory == same.trajectory == plan(parse_template(square), Vehicle(), PlanOptions()).trajectory
    assert other.trajectory == plan(parse_template(square), wide, PlanOptions()).trajectory
    assert other.trajectory != own.trajectory
    refused = planned("broken", '{"track_width_m": 99}')
    assert not refused.success
    assert "the request's vehicle: drive.track_width_m is 99" in refused.message
    assert planned("none", "{]").message.startswith("the request's vehicle")


def test_bad_templates_and_options_are_answered_and_the_next_request_is_served(bus: Bus) -> None:
    square = template_text("study-square")[0]
    dot = '{"name": "n", "segments": [{"id": "d", "arc": {"start": [0.2, 0], "center": [0, 0], "sweep_angle": 6}}]}'
    for name, request, expected in (
        ("json", PlanRequest(template_json="{]"), "not JSON"),
        ("dot", PlanRequest(template_json=dot, options=PlanOptions(kappa_max_1pm=1.125)), 'segment "d"'),
        ("method", PlanRequest(template_json=square, options=PlanOptions(method="x")), "unknown method"),
    ):
        response = bus.call(topics.PLAN_SERVICE, request.model_copy(update={"request_id": name}), ANSWER_S)
        assert not response.success
        assert expected in response.message
    assert bus.call(topics.PLAN_SERVICE, PlanRequest(request_id="good", template_json=square), ANSWER_S).success


def test_diagnostics_count_what_it_was_asked(bus: Bus) -> None:
    def counts() -> tuple[int, int, int]:
        service = topics.diagnostics_service(topics.PLANNER)
        status = bus.call(service, GetDiagnosticsRequest(), ANSWER_S).diagnostics.status[0]
        values = {value.key: value.value for value in status.values}
        assert status.message == "ready"
        return int(values["plans"]), int(values["refused"]), int(values["failed"])

    square = template_text("study-square")[0]
    plans, refused, failed = counts()
    for name, text in (("1", square), ("2", "{]")):
        bus.call(topics.PLAN_SERVICE, PlanRequest(request_id=f"count {name}", template_json=text), ANSWER_S)
    assert counts() == (plans + 1, refused + 1, failed)
    assert failed == 0


def test_it_is_starting_until_its_kernels_are_loaded() -> None:
    worker, tally = Worker((Vehicle(),)), RequestTally()
    assert condition(worker, tally) == (DiagnosticStatus.WARN, "starting: loading kernels")
    worker.warm.set()
    assert condition(worker, tally) == (DiagnosticStatus.OK, "ready")


def test_it_ends_cleanly_when_told_to(bus: Bus, planner: "subprocess.Popen[str]") -> None:
    planner.send_signal(signal.SIGTERM)
    assert planner.wait(100.0) == 0
    assert planner.stderr is not None
    assert planner.stderr.read() == ""
