"""A robot that is killed amid a job on a machine that has never compiled anything, and goes on."""

import os
import signal
import uuid

import pytest

from tests.meeting import eventually
from tests.robot_sim.bus_rig import PLAN, TEMPLATE
from touchline.schemas import topics
from touchline.schemas.messages import (
    GetDiagnosticsRequest,
    TraversalStatus,
)
from touchline.schemas.setup import Setup
from touchline.supervision.late_compilations import KEY
from touchline.supervision.temporary_system import ProcessOptions, local_system

ALONE = ProcessOptions(without=(topics.PLANNER, topics.BRIDGE))


@pytest.mark.full
def test_it_is_not_killed_again_for_what_it_would_have_to_compile(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    told, notices = [], []
    with local_system({"tt2": Setup()}, options=ALONE) as system:
        bus = system.bus

        def watch():
            notices.extend(notice.kind for notice in system.poll())

        def meanwhile(condition):
            watch()
            return condition()

        def ask(service, **fields):
            request = service.request(request_id=uuid.uuid4().hex, **fields)
            answer = bus.call(service, request, 60.0, watch)
            assert answer.success, answer.message

        def run_until(state):
            inbox = bus.inbox([topics.STATUS])
            assert eventually(
                lambda: meanwhile(lambda: any(said.state == state for _, said in inbox.messages())), 200.0
            )

        assert system.wait_until_ready(told.append)
        job = {"trajectory": PLAN, "template_json": TEMPLATE.model_dump_json()}
        ask(topics.LOAD, **job)
        ask(topics.START)
        run_until(TraversalStatus.RUNNING)
        os.kill(system.supervisor.pid(topics.ROBOT_SIM), signal.SIGKILL)
        assert eventually(lambda: meanwhile(lambda: "restarted" in notices))
        assert system.wait_until_ready(told.append)
        ask(topics.LOAD, resume=True, **job)
        ask(topics.SET_SPEED, factor=20.0)
        ask(topics.START)
        run_until(TraversalStatus.DONE)
        service = topics.diagnostics_service(topics.ROBOT_SIM)
        (robot,) = bus.call(service, GetDiagnosticsRequest()).diagnostics.status
    assert any("compiling 1 of 6 (world): " in line for line in told)
    assert notices.count("died") == 1
    assert "hung" not in notices
    assert KEY not in {value.key for value in robot.values}
