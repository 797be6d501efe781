"""A secured router that takes over a new access list, with real sessions."""

import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from datetime import timedelta
from itertools import count
from pathlib import Path

import pytest

from touchline.bus import Bus, BusConfig, presence, secured_router
from touchline.bus.ports import free_port
from touchline.bus.presence import Presence, PresenceChange
from touchline.bus.secured_router import SecuredRouter
from touchline.schemas import topics
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.roles import Role
from touchline.security.authority import CertificateAuthority
from touchline.security.identity import Identity
from touchline.services.robot_sim.guards import LinkWatch


@pytest.fixture
def keys(tmp_path: Path) -> CertificateAuthority:
    authority = CertificateAuthority.create(tmp_path / "keys", f"tls/127.0.0.1:{free_port()}")
    authority.issue([authority.new_member(Role.ROBOT, "tt2"), authority.new_member(Role.OPERATOR, "anna")])
    return authority


def identity(authority: CertificateAuthority, name: str) -> Identity:
    return Identity.load(authority.folder_of(authority.named(name)))


def config(authority: CertificateAuthority, name: str) -> BusConfig:
    return BusConfig(authority.access.router, ("tt2",), identity=identity(authority, name))


ROUTER = """
import sys, time
from pathlib import Path
from touchline.bus import BusConfig, secured_router
from touchline.bus.router import open_router
from touchline.security.identity import Identity

secured_router._QUIET_S = float(sys.argv[2])
identity = Identity.load(Path(sys.argv[1]))
with open_router(BusConfig(identity.access.router, identity=identity)) as poll:
    print("ready", flush=True)
    while True:
        poll()
        time.sleep(0.05)
"""
QUIET_S = 2.0


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return tmp_path / "router.log"


@pytest.fixture
def routing(keys: CertificateAuthority, log: Path) -> Iterator[subprocess.Popen[str]]:
    """A router's process, which shares nothing with these sessions."""
    folder = keys.folder_of(keys.named("router.main"))
    with log.open("wb") as output:
        command = [sys.executable, "-c", ROUTER, folder, str(QUIET_S)]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=output, text=True)
    with process:
        assert process.stdout is not None and process.stdout.readline() == "ready\n", log.read_text()
        yield process
        process.kill()


@pytest.fixture
def router(routing: subprocess.Popen[str], log: Path) -> Path:
    """The log of the router's process."""
    return log


def until(holds: Callable[[], object], within_s: float = 15.0) -> bool:
    """Wait until something holds; return whether it does."""
    deadline = time.monotonic() + within_s
    while not holds() and time.monotonic() < deadline:
        time.sleep(0.02)
    return bool(holds())


def alive(there: Presence) -> set[str]:
    there.poll()
    return there.alive()


def admitted(config: BusConfig) -> bool:
    try:
        with Bus.open(topics.OBSERVER, config):
            return True
    except TouchlineError:
        return False


def test_a_new_member_waits_while_a_robot_drives_and_a_revoked_one_is_out_at_once(keys, router, tmp_path, monkeypatch):
    monkeypatch.setattr("touchline.bus.joining._ADMITTED_S", 0.3)
    copy = shutil.copytree(keys.folder_of(keys.named("operator.anna")), tmp_path / "anna")
    anna = config(keys, "operator.anna").as_identity(Identity.load(copy))
    with Bus.open(topics.ROBOT_SIM, config(keys, "robot.tt2")) as robot:
        status = robot.publisher(topics.STATUS)

        def drive(seconds: float) -> None:
            end_s = time.monotonic() + seconds
            while time.monotonic() < end_s:
                status.send(TraversalStatus(state=TraversalStatus.RUNNING))
                time.sleep(0.1)

        drive(1.0)
        keys.issue([keys.new_member(Role.OPERATOR, "bea")])
        bea = config(keys, "operator.bea")
        drive(QUIET_S)
        assert not admitted(bea)

        def admitted_while_paused() -> bool:
            status.send(TraversalStatus(state=TraversalStatus.PAUSED))
            return admitted(bea)

        assert until(admitted_while_paused)

        drive(1.0)
        assert admitted(anna)
        keys.revoke(keys.named("operator.anna"))
        drive(1.0)
        assert not admitted(anna)
        assert admitted(bea)


def test_presence_outlasts_the_routers_change_and_sees_who_has_left(keys, router):
    with Bus.open(topics.OPERATOR, config(keys, "operator.anna")) as bus:
        there, first = bus.presence(), bus.peers()
        with Bus.open(topics.ROBOT_SIM, config(keys, "robot.tt2")):
            assert until(lambda: topics.ROBOT_SIM in alive(there))
            keys.issue([keys.new_member(Role.OPERATOR, "bea")])
            changes: list[PresenceChange] = []
            assert until(lambda: changes.extend(there.poll()) or bus.peers() - first)
            until(lambda: changes.extend(there.poll()), 2.0)
            assert [change for change in changes if change.node == topics.ROBOT_SIM] == []
            assert topics.ROBOT_SIM in there.alive()
        assert until(lambda: topics.ROBOT_SIM not in alive(there), 3.0)


def test_the_loss_of_a_link_is_logged_with_its_reason(keys, routing, monkeypatch, caplog):
    caplog.set_level("INFO", "touchline.bus.link_log")
    monkeypatch.setattr("touchline.bus.link_log._LOOK_S", 0.1)
    anna, tt2 = config(keys, "operator.anna"), config(keys, "robot.tt2")
    with Bus.open(topics.OPERATOR, anna), Bus.open(topics.ROBOT_SIM, tt2):
        monkeypatch.setattr(keys, "_life", lambda _: timedelta(seconds=-1))
        keys.renew([keys.named("operator.anna")])
        assert "operator.anna" in anna.identity_problem() and not tt2.identity_problem()
        routing.kill()
        assert until(lambda: caplog.text.count("no link to the router: ") == 2)
        assert "no link to the router: operator.anna" in caplog.text and "expired on" in caplog.text
        assert f"no link to the router: nobody listens at {tt2.endpoint}" in caplog.text
    keys.revoke(keys.named("operator.anna"))
    assert anna.identity_problem().startswith("operator.anna is revoked, or was moved: ")


def test_a_robot_without_a_router_counts_from_the_loss_of_its_link(keys, routing, monkeypatch):
    """Others are missed only a while later: they may be back when the router is."""
    monkeypatch.setattr(presence, "_BACK_S", 1000.0)
    with (
        Bus.open(topics.ROBOT_SIM, config(keys, "robot.tt2")) as robot,
        Bus.open(topics.OPERATOR, config(keys, "operator.anna")),
    ):
        watch, now_s = LinkWatch(robot, 2.0), count(0.0, 2.1)
        assert until(lambda: not watch.lost(True, next(now_s)) and watch.attended)
        routing.kill()
        assert until(lambda: watch.lost(True, next(now_s)))
        assert watch.attended


def test_an_access_list_that_is_damaged_changes_nothing(keys, router):
    anna = config(keys, "operator.anna")
    assert admitted(anna)
    path = keys.folder_of(keys.named("router.main")) / "access.json"
    path.write_text(path.read_text().replace("operator.anna", "operator.eve"))
    assert until(lambda: "is damaged, forged, or of another authority" in router.read_text())
    assert admitted(anna)


def test_a_router_whose_port_is_taken_meanwhile_waits_for_it(keys, monkeypatch, tmp_path):
    """Its links are closed for the change; another program may be quicker."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    router, taken = SecuredRouter(config(keys, "router.main"), alone=False), [True]

    def listen(*arguments):
        if taken:
            taken.pop()
            raise TouchlineError("the router cannot listen")
        return real(*arguments)

    real = secured_router.listen
    monkeypatch.setattr(secured_router, "listen", listen)
    try:
        keys.revoke(keys.named("operator.anna"))
        router.poll()
        assert router._session is None
        router.poll()
        assert router._session is not None
    finally:
        router.close()
