"""When a secured router takes over a new access list, with real sessions."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from touchline.bus import Bus, BusConfig
from touchline.bus import secured_router as module
from touchline.bus.ports import free_port
from touchline.bus.presence import Presence
from touchline.bus.secured_router import SecuredRouter
from touchline.schemas import topics
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.roles import Role
from touchline.security.authority import CertificateAuthority
from touchline.security.identity import Identity


@pytest.fixture
def keys(tmp_path: Path) -> CertificateAuthority:
    authority = CertificateAuthority.create(tmp_path / "keys", f"tls/127.0.0.1:{free_port()}")
    authority.issue([authority.new_member(Role.ROBOT, "tt2"), authority.new_member(Role.OPERATOR, "anna")])
    return authority


def identity(authority: CertificateAuthority, name: str) -> Identity:
    return Identity.load(authority.folder_of(authority.named(name)))


def config(authority: CertificateAuthority, name: str) -> BusConfig:
    return BusConfig(authority.access.router, ("tt2",), identity=identity(authority, name))


@pytest.fixture
def router(keys: CertificateAuthority, monkeypatch: pytest.MonkeyPatch) -> Iterator[SecuredRouter]:
    monkeypatch.setattr(module, "watch_refusals", lambda audit, linked: None)
    router = SecuredRouter(config(keys, "router.main"))
    yield router
    router.close()


def until(router: SecuredRouter, holds: Callable[[], object], within_s: float = 10.0) -> bool:
    """Let the router work until something holds; return whether it does."""
    deadline = time.monotonic() + within_s
    while not holds() and time.monotonic() < deadline:
        router.poll()
        time.sleep(0.02)
    return bool(holds())


def alive(presence: Presence) -> set[str]:
    presence.poll()
    return presence.alive()


def admitted(config: BusConfig) -> bool:
    try:
        with Bus.open(topics.OBSERVER, config):
            return True
    except TouchlineError:
        return False


def test_a_new_member_waits_while_a_robot_drives_and_a_revoked_one_is_out_at_once(keys, router, monkeypatch):
    monkeypatch.setattr("touchline.bus.joining._ADMITTED_S", 0.3)
    anna = config(keys, "operator.anna")
    with Bus.open(topics.ROBOT_SIM, config(keys, "robot.tt2")) as robot:
        status = robot.publisher(topics.STATUS)

        def drives() -> None:
            status.send(TraversalStatus(state=TraversalStatus.RUNNING))
            assert not until(router, lambda: False, 0.2)

        drives()
        keys.issue([keys.new_member(Role.OPERATOR, "bea")])
        bea = config(keys, "operator.bea")
        drives()
        assert not admitted(bea)
        monkeypatch.setattr(module, "_QUIET_S", 0.5)
        assert until(router, lambda: admitted(bea))

        monkeypatch.setattr(module, "_QUIET_S", 1e6)
        drives()
        keys.revoke(keys.named("operator.anna"))
        assert until(router, lambda: not admitted(anna))
        assert admitted(bea)


def test_presence_outlasts_the_routers_change_and_sees_who_has_left(keys, router):
    with Bus.open(topics.OPERATOR, config(keys, "operator.anna")) as bus:
        presence = bus.presence()
        with Bus.open(topics.ROBOT_SIM, config(keys, "robot.tt2")):
            assert until(router, lambda: topics.ROBOT_SIM in alive(presence))
            keys.issue([keys.new_member(Role.OPERATOR, "bea")])
            begun = bus.peers()
            changes = []
            assert until(router, lambda: changes.extend(presence.poll()) or bus.peers() - begun)
            until(router, lambda: changes.extend(presence.poll()), 2.0)
            assert [change for change in changes if change.node == topics.ROBOT_SIM] == []
        assert until(router, lambda: topics.ROBOT_SIM not in alive(presence), 3.0)


def test_an_access_list_that_is_damaged_changes_nothing(keys, router, caplog):
    path = router._config.identity.folder / "access.json"
    path.write_text(path.read_text().replace("operator.anna", "operator.eve"))
    until(router, lambda: "stays so" in caplog.text, 5.0)
    assert "is damaged, forged, or of another authority" in caplog.text
    assert admitted(config(keys, "operator.anna"))
