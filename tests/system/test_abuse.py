"""Every queryable and every topic gets what nobody should send; every service still answers."""

import os
import random
import time

import pytest
import zenoh

from tests.meeting import eventually
from touchline.schemas import topics
from touchline.schemas.catalogue import template_text
from touchline.schemas.cdr import MAX_PAYLOAD_BYTES
from touchline.schemas.messages import GetDiagnosticsRequest, PlanRequest
from touchline.schemas.setup import Setup
from touchline.supervision.temporary_system import LocalSystem, local_system

NODES = (topics.PLANNER, topics.ROBOT_SIM, topics.BRIDGE)
ANSWER_S = 200.0
"""The first plan may wait for the kernels to be compiled."""


@pytest.fixture(scope="module")
def system():
    with local_system({"tt2": Setup()}) as it:
        it.wait_until_ready(lambda doing: None)
        yield it


@pytest.fixture(scope="module")
def outsider(system: LocalSystem):
    with zenoh.open(system.bus.config.zenoh()) as session:
        keys = [system.bus.key(service.name) for service in topics.SERVICES]
        deadline = time.monotonic() + 100.0
        while not all(list(session.get(key, timeout=5.0)) for key in keys):
            assert time.monotonic() < deadline, "not every service was found"
        yield session


def assert_all_answer(system: LocalSystem) -> None:
    assert [notice.text for notice in system.poll()] == []
    for node in NODES:
        system.bus.call(topics.diagnostics_service(node), GetDiagnosticsRequest(), ANSWER_S)
    text, _ = template_text("study-square")
    assert system.bus.call(topics.PLAN_SERVICE, PlanRequest(template_json=text), ANSWER_S).success


def junk(generator: random.Random) -> list[bytes]:
    """Random bytes, and CDR headers followed by them."""
    sizes = [0, 1, 3, 4, 5, 8, 40, 1000]
    return [head + generator.randbytes(size) for size in sizes for head in (b"", b"\x00\x01\x00\x00")]


@pytest.mark.parametrize("service", topics.SERVICES, ids=lambda service: service.name)
def test_random_bytes_on_every_queryable(system, outsider, service):
    for payload in junk(random.Random(service.name)):
        replies = list(outsider.get(system.bus.key(service.name), payload=payload, timeout=ANSWER_S))
        assert len(replies) == 1, f"{service.name} did not answer {payload[:20]!r}"
        if replies[0].err is not None:
            assert replies[0].err.payload.to_string()
    assert_all_answer(system)


def test_random_bytes_on_every_topic(system, outsider):
    generator = random.Random("topics")
    for topic in topics.TOPICS:
        for payload in junk(generator):
            outsider.put(system.bus.key(topic.name), payload)
    assert_all_answer(system)


def refusal(system, outsider, service, payload):
    """What is said; "Timeout" where a busy machine took so long over the fragments that Zenoh dropped the message."""
    (reply,) = outsider.get(system.bus.key(service.name), payload=payload, timeout=20.0)
    return reply.err.payload.to_string()


def test_more_than_is_decoded(system, outsider):
    huge = b"\x00\x01\x00\x00" + os.urandom(1000) + bytes(MAX_PAYLOAD_BYTES)
    for service in (topics.PLAN_SERVICE, topics.LOAD, topics.RECORD):
        assert eventually(lambda service=service: "at most" in refusal(system, outsider, service, huge), ANSWER_S)
    outsider.put(system.bus.key(topics.EVENTS.name), huge)
    assert_all_answer(system)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "is not JSON"),
        ("[" * 10_000, "nested"),
        ('{"name": "t", "segments": [{"id": "a", "line": {"start": [0, 0], "end": [NaN, 0]}}]}', "end[0] is nan"),
        (
            '{"name": "t", "segments": [{"id": "r", "arc": {"start": [0.1, 0], "center": [0, 0], "sweep_angle": 1}}]}',
            '"r"',
        ),
    ],
    ids=["empty", "deep", "NaN", "undrivable"],
)
def test_the_planner_refuses_bad_templates(system, text, says):
    request = PlanRequest(template_json=text, options={"kappa_max_1pm": 1.125})
    response = system.bus.call(topics.PLAN_SERVICE, request, ANSWER_S)
    assert not response.success
    assert says in response.message
    assert_all_answer(system)


def test_the_planner_refuses_bad_options(system):
    text, _ = template_text("study-square")
    for options in ({"method": "magic"}, {"kappa_max_1pm": float("nan")}, {"sigma_max_1pm2": -1.0}, {"start": [1.0]}):
        request = PlanRequest(template_json=text, options=options)
        response = system.bus.call(topics.PLAN_SERVICE, request, ANSWER_S)
        assert not response.success, options
        assert response.message
    assert_all_answer(system)
