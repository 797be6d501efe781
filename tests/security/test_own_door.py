"""A robot's own door on a secured bus: without a router, and after a renewal."""

import time
from collections.abc import Callable
from pathlib import Path

import pytest

from touchline.bus import Bus, BusConfig
from touchline.bus.joining import join_at_door, listen
from touchline.bus.own_door import OwnDoor
from touchline.bus.ports import free_port
from touchline.schemas.errors import TouchlineError
from touchline.schemas.roles import Role
from touchline.security.authority import CertificateAuthority
from touchline.security.identity import Identity

ASKED = "tt2/traversal/estop/@by/operator.anna"


@pytest.fixture
def keys(tmp_path: Path) -> CertificateAuthority:
    authority = CertificateAuthority.create(tmp_path / "keys", f"tls/127.0.0.1:{free_port()}")
    authority.issue([authority.new_member(Role.ROBOT, "tt2")])
    authority.issue([authority.new_member(Role.OPERATOR, "anna")])
    return authority


def config(authority: CertificateAuthority, name: str) -> BusConfig:
    identity = Identity.load(authority.folder_of(authority.named(name)))
    return BusConfig(authority.access.router, ("tt2",), identity=identity)


def answers(operator: BusConfig) -> list[bytes]:
    """Ask at the door, where nobody answers while it is being opened anew."""
    (door,) = operator.doors()
    try:
        with join_at_door(operator, door, lambda: False) as session:
            return [reply.ok.payload.to_bytes() for reply in session.get(ASKED, timeout=2.0) if reply.ok is not None]
    except TouchlineError:
        return []


def until(holds: Callable[[], object]) -> bool:
    deadline = time.monotonic() + 15.0
    while not holds() and time.monotonic() < deadline:
        time.sleep(0.1)
    return bool(holds())


def test_a_door_opens_without_a_router_and_anew_with_a_renewed_certificate(keys):
    opened, held = [], []

    def declare(session):
        opened.append(str(session.zid()))
        served = session.declare_queryable(
            "tt2/traversal/estop/@by/*", lambda query: query.reply(query.key_expr, b"stopped"), complete=True
        )
        token = session.liveliness().declare_token(f"@touchline/tt2/robot-sim/{session.zid()}")
        held[:] = [served]
        return token

    door = OwnDoor(config(keys, "robot.tt2"), declare)
    try:
        anna = config(keys, "operator.anna")
        assert until(lambda: answers(anna) == [b"stopped"])
        keys.renew([keys.named("robot.tt2")])
        assert until(lambda: len(opened) == 2)
        assert until(lambda: answers(anna) == [b"stopped"])
    finally:
        door.close()
    assert answers(anna) == []


def test_a_door_of_another_machine_and_one_that_is_taken(keys):
    keys.issue([keys.new_member(Role.ROBOT, "far", ["192.0.2.3"])])
    with pytest.raises(TouchlineError, match="no such address: is the identity another machine's"):
        listen(config(keys, "robot.far").own_door(), "the robot's own door")
    router = config(keys, "router.main").router()
    with listen(router, "the router"), pytest.raises(TouchlineError, match=r"in use .* stop what listens there"):
        listen(router, "the router")


def test_a_robots_identity_is_for_its_robot_alone(keys):
    keys.issue([keys.new_member(Role.ROBOT, "tt3")])
    other = config(keys, "robot.tt3").of("tt2")
    with (
        pytest.raises(TouchlineError, match=r"robot\.tt3 is of the robot tt3, not of tt2"),
        Bus.open("robot-sim", other),
    ):
        pass
    with pytest.raises(TouchlineError, match="cannot join as operator"), Bus.open("operator", other):
        pass
