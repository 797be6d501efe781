"""Attacks on a real secured system, from the topic table: everybody who may not, on everything there is."""

import time
from collections.abc import Iterator
from contextlib import ExitStack
from datetime import timedelta
from itertools import product
from pathlib import Path

import pytest
import zenoh

from tests.meeting import eventually
from tests.security.secured_system import ROBOTS, SecuredSystem, secured_system
from touchline.bus import Bus
from touchline.bus.access_control import nodes_of
from touchline.bus.caller import asked_key, served_key
from touchline.bus.prompt import prompt_key
from touchline.bus.secured_check import can_join
from touchline.bus.secured_settings import doors, secured_at_door, secured_client
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.errors import TouchlineError
from touchline.schemas.roles import Role
from touchline.security import certificates
from touchline.security.authority import CertificateAuthority
from touchline.security.identity import Identity

pytestmark = pytest.mark.xdist_group("secured system")

VICTIM, OTHER = ROBOTS
#: Who attacks: one identity of each role but the victim itself; the second robot's is no better than the others.
ATTACKERS = tuple(role for role in Role if role not in (Role.ROUTER, Role.ROBOT))
HISTORY = "@adv/pub/1/2/_"
"""Key behind a latched topic's of what late joiners are told."""
SETTLED_S = 0.5
"""Time in which what gets through arrives."""


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SecuredSystem]:
    with secured_system(tmp_path_factory.mktemp("secured")) as running:
        yield running


@pytest.fixture(scope="module")
def sessions(system: SecuredSystem) -> Iterator[dict[Role | str, zenoh.Session]]:
    """A session of each identity."""
    with ExitStack() as stack:
        yield {who: stack.enter_context(system.session(who)) for who in (*ATTACKERS, VICTIM, OTHER)}


def role_of(who: Role | str) -> Role:
    return who if isinstance(who, Role) else Role.ROBOT


def publishes(who: Role | str, topic: topics.Topic) -> bool:
    return role_of(who) in topic.publishers and who != OTHER


def test_each_topic_is_heard_from_those_who_may_publish_it_and_from_nobody_else(system, sessions):
    heard = set()

    def note(sample: zenoh.Sample) -> None:
        heard.add((str(sample.key_expr), sample.payload.to_bytes()))

    with system.session(Role.OBSERVER) as listener:
        listener.declare_subscriber(f"{VICTIM}/**", note)
        listener.declare_subscriber(f"{VICTIM}/**/@adv/**", note)
        listener.declare_subscriber(prompt_key(f"{VICTIM}/**"), note)
        time.sleep(SETTLED_S)
        publish_everything(sessions)
        time.sleep(SETTLED_S)
    for who, topic in product(sessions, topics.TOPICS):
        may, said = publishes(who, topic), f"from {who}".encode()
        assert ((f"{VICTIM}/{topic.name}", said) in heard) == may, f"{who} on {topic.name}"
        kept = (f"{VICTIM}/{topic.name}/{HISTORY}", said) in heard
        assert kept == (may and topic.latched), f"{who} as history of {topic.name}"
        prompt = (prompt_key(f"{VICTIM}/{topic.name}"), said) in heard
        assert prompt == (may and topic.prompt), f"{who} as prompt copy of {topic.name}"


def publish_everything(sessions: dict[Role | str, zenoh.Session]) -> None:
    for (who, session), topic in product(sessions.items(), topics.TOPICS):
        session.put(f"{VICTIM}/{topic.name}", f"from {who}".encode())
        session.put(f"{VICTIM}/{topic.name}/{HISTORY}", f"from {who}".encode())
        session.put(prompt_key(f"{VICTIM}/{topic.name}"), f"from {who}".encode())


def test_nobody_answers_in_the_name_of_a_service(system, sessions):
    with ExitStack() as declared:
        for (who, session), service in product(sessions.items(), topics.ALL_SERVICES):
            may = role_of(who) in service.servers and who != OTHER
            if not may:
                key, answer = served_key(f"{VICTIM}/{service.name}"), f"rogue {who}".encode()
                rogue = session.declare_queryable(key, lambda query, answer=answer: query.reply(query.key_expr, answer))
                declared.callback(rogue.undeclare)
        time.sleep(SETTLED_S)
        operator = declared.enter_context(system.session(Role.OPERATOR))
        for service in topics.ALL_SERVICES:
            key = asked_key(f"{VICTIM}/{service.name}", system.identities[Role.OPERATOR].name)
            for reply in operator.get(key, target=zenoh.QueryTarget.ALL, timeout=0.3):
                assert reply.ok is None or not reply.ok.payload.to_bytes().startswith(b"rogue"), service.name


def test_nobody_is_present_in_the_name_of_another(sessions):
    every = {node for role in Role for node in nodes_of(role)}
    tokens = [
        session.liveliness().declare_token(f"@touchline/{VICTIM}/{node}/{session.zid()}")
        for session, node in product(sessions.values(), every)
    ]
    time.sleep(SETTLED_S)
    replies = sessions[Role.OBSERVER].liveliness().get("@touchline/**", timeout=2.0)
    seen = {tuple(str(reply.ok.key_expr).split("/")[2:4]) for reply in replies if reply.ok is not None}
    for token in tokens:
        token.undeclare()
    for (who, session), node in product(sessions.items(), every):
        if session is sessions[Role.OBSERVER]:  # sees its own without the router
            continue
        may = node in nodes_of(role_of(who)) and who != OTHER
        assert ((node, str(session.zid())) in seen) == may, f"{who} as {node}"


def test_no_role_is_served_what_it_may_not_ask_for(system, sessions):
    request = encode(m.CommandRequest(request_id="attack"))
    served = {topics.PLANNER, topics.ROBOT_SIM, topics.BRIDGE, topics.TELEMETRY}
    for (who, session), service in product(sessions.items(), topics.ALL_SERVICES):
        if role_of(who) in service.callers or service.server not in served:
            continue
        key = f"{VICTIM}/{service.name}"
        (answer,) = session.get(asked_key(key, system.identities[who].name), payload=request, timeout=5.0)
        reason = answer.err.payload.to_string() if answer.err is not None else ""
        assert reason.startswith(f"refused: {system.identities[who].name} may not ask for {service.name}"), (
            who,
            reason,
        )
        names = {"operator.root", system.identities[Role.OPERATOR].name, "*", ""}
        for false in sorted(names - {system.identities[who].name}):
            as_another = asked_key(key, false)
            assert list(session.get(as_another, payload=request, timeout=1.0)) == [], f"{who} as {false!r}"
    noted = {(line["identity"], line["order"], line["answer"]) for line in until_audited(system, "inject_fault")}
    for who in sessions:
        if role_of(who) not in topics.INJECT_FAULT.callers:
            assert (system.identities[who].name, topics.INJECT_FAULT.name, "refused") in noted


def until_audited(system: SecuredSystem, order: str) -> list[dict[str, str]]:
    """Wait until the audit log knows of an order, and return all of it."""
    deadline = time.monotonic() + 10.0
    while not any(order in line["order"] for line in system.audited()):
        assert time.monotonic() < deadline
        time.sleep(0.1)
    time.sleep(1.0)  # the router writes once a second
    return system.audited()


def test_a_recorded_request_is_worth_nothing_to_others(system, sessions):
    request = encode(m.CommandRequest(request_id="recorded earlier"))
    with Bus.open(topics.OPERATOR, system.config(Role.OPERATOR)) as bus:
        first = bus.call(topics.ESTOP, m.CommandRequest(request_id="recorded earlier"))
        assert first.success
        assert eventually(lambda: bus.call(topics.RESET, m.CommandRequest(request_id=f"reset {time.time()}")).success)
    observer, key = sessions[Role.OBSERVER], f"{VICTIM}/{topics.ESTOP.name}"
    assert list(observer.get(asked_key(key, system.identities[Role.OPERATOR].name), payload=request, timeout=1.0)) == []
    (answer,) = observer.get(asked_key(key, system.identities[Role.OBSERVER].name), payload=request, timeout=2.0)
    assert answer.ok is None


def test_a_robots_own_door_admits_only_those_who_may_stop_it(system):
    door = doors(system.identities[VICTIM], system.endpoint)[VICTIM]
    for who in (*ATTACKERS, OTHER):
        identity = system.identities[who]
        patient = secured_at_door(identity, door)
        patient.insert_json5("connect/timeout_ms", "20000")  # a busy machine shakes hands slowly
        with zenoh.open(patient) as session:
            for service in (topics.PAUSE, topics.START):
                key = asked_key(f"{VICTIM}/{service.name}", identity.name)
                payload = encode(m.CommandRequest(request_id=f"{who}"))
                replies = list(session.get(key, payload=payload, timeout=2.0))
                answered = [reply for reply in replies if reply.ok is not None]
                may = service is topics.PAUSE and role_of(who) in service.callers
                assert bool(answered) == may, f"{who}: {service.name}"


def sealed_off(system: SecuredSystem, identity: Identity) -> bool:
    """Return whether neither the router nor a robot's own door takes a session with these credentials."""
    for opened in (
        secured_client(identity, system.endpoint, 1.0),
        secured_at_door(identity, doors(identity, system.endpoint)[VICTIM]),
    ):
        opened.insert_json5("connect/timeout_ms", "1000")
        opened.insert_json5("connect/exit_on_failure", "true")
        try:
            zenoh.open(opened).close()
        except zenoh.ZError:
            continue
        return False
    return True


def test_nobody_joins_without_a_certificate_of_the_authority(system, tmp_path):
    address = system.endpoint.partition("/")[2]
    door = doors(system.identities[VICTIM], system.endpoint)[VICTIM]
    authority = system.identities[VICTIM].authority
    for endpoint in (f"tcp/{address}", f"udp/{address}", system.endpoint, door, f"udp/{door.partition('/')[2]}"):
        assert not can_join(endpoint, authority), endpoint

    foreign = tmp_path / "foreign"
    CertificateAuthority.create(foreign, system.endpoint)
    with CertificateAuthority.changing(foreign) as other:
        robot = other.new_member(Role.ROBOT, VICTIM)
        operator = other.new_member(Role.OPERATOR, "root")
        other.issue([robot, operator])
        stranger = Identity.load(other.folder_of(operator))
    assert sealed_off(system, stranger)

    with pytest.MonkeyPatch.context() as unchecked:  # ours would not load it
        unchecked.setattr(certificates, "check_time", lambda *_: None)
        expired = system.issue(Role.OPERATOR, "expired", timedelta(seconds=-1))
    assert sealed_off(system, expired)
    lines = until_audited(system, "join")
    reasons = {line["text"].partition(",")[0] for line in lines if line["order"] == "join"}
    assert reasons == {"no certificate", "no TLS", "a certificate of another authority", "an expired certificate"}


def test_a_revoked_identity_is_out_within_seconds_while_it_is_linked(system):
    eve = system.issue(Role.OPERATOR, "eve")
    wait_until_admitted(system, eve)
    with zenoh.open(secured_client(eve, system.endpoint, 1.0)) as session:
        heard: list[str] = []
        session.declare_subscriber(f"{VICTIM}/**", lambda sample: heard.append(str(sample.key_expr)))
        deadline = time.monotonic() + 10.0
        while not heard and time.monotonic() < deadline:
            time.sleep(0.05)
        assert heard
        with CertificateAuthority.changing(system.keys) as authority:
            authority.revoke(authority.named(eve.name))
        time.sleep(5.0)
        heard.clear()
        key = asked_key(f"{VICTIM}/{topics.PAUSE.name}", eve.name)
        payload = encode(m.CommandRequest(request_id="revoked"))
        assert list(session.get(key, payload=payload, timeout=1.0)) == []
        time.sleep(1.0)
        assert heard == []


def wait_until_admitted(system: SecuredSystem, identity: Identity) -> None:
    """Wait until the router knows an identity that has just been issued."""
    deadline = time.monotonic() + 20.0
    while True:
        try:
            with Bus.open(topics.OBSERVER, system.config(identity)):
                return
        except TouchlineError:
            assert time.monotonic() < deadline


def test_no_process_listens_without_tls(system):
    address = int(system.endpoint.rpartition(":")[2])
    assert ports_of_group(system.process.pid) == {address}


def ports_of_group(pid: int) -> set[int]:
    """Return the TCP ports at which a process and all its descendants listen."""
    children: dict[int, list[int]] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        children.setdefault(int(fields[1]), []).append(int(stat.parent.name))
    pids, found = [pid], set[str]()
    for each in pids:
        pids += children.get(each, [])
        for descriptor in Path(f"/proc/{each}/fd").glob("*"):
            try:
                found.add(str(descriptor.readlink()))
            except OSError:
                continue
    ports = set()
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        for line in Path(table).read_text().splitlines()[1:]:
            (
                _,
                local,
                _,
                state,
                *_,
            ) = line.split()
            inode = line.split()[9]
            if state == "0A" and f"socket:[{inode}]" in found:
                ports.add(int(local.rpartition(":")[2], 16))
    return ports
