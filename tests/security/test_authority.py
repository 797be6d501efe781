"""Issuing, renewing and revoking lose nothing, whatever is in their way."""

import resource
import shutil
import stat
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from pathlib import Path

import pytest

from touchline.schemas.errors import SpecError
from touchline.schemas.roles import Role
from touchline.security import certificates, identity
from touchline.security.authority import CertificateAuthority, issued_for_system
from touchline.security.identity import Identity


def issued(authority: CertificateAuthority, role: Role, name: str, *hosts: str, days: float = 30.0) -> Identity:
    member = authority.new_member(role, name, hosts)
    authority.issue([member], timedelta(days=days))
    return Identity.load(authority.folder_of(member))


def files(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file() and path.name != ".lock"}


def later(monkeypatch: pytest.MonkeyPatch, **delay: float) -> None:
    """Set the clock of what follows."""
    at = certificates.now() + timedelta(**delay)
    monkeypatch.setattr(certificates, "now", lambda: at)


def test_nobody_else_can_read_the_keys(authority: CertificateAuthority) -> None:
    issued(authority, Role.OPERATOR, "anna")
    for path in (authority.folder, *authority.folder.rglob("*.pem"), *authority.folder.rglob("access.json")):
        assert stat.S_IMODE(path.stat().st_mode) == (0o700 if path.is_dir() else 0o600)


def test_what_is_issued_is_on_every_list(authority: CertificateAuthority) -> None:
    robot = issued(authority, Role.ROBOT, "field/tt2", "10.0.0.3", "tt2.local")
    assert (robot.name, robot.role, robot.namespace) == ("robot.field.tt2", Role.ROBOT, "field/tt2")
    member = robot.access.member("robot.field.tt2")
    assert member and member.door == "quic/10.0.0.3:7462" and member.hosts == ("10.0.0.3", "tt2.local")
    router = Identity.load(authority.folder / "identities" / "router.main")
    assert router.access == robot.access == CertificateAuthority(authority.folder).access
    assert [each.name for each in router.access.members] == ["router.main", "robot.field.tt2"]


@pytest.mark.parametrize(
    ("role", "name", "hosts", "says"),
    [
        (Role.ROBOT, "a.b", (), "NAME is 'a.b'; give the robot's namespace: use letters, digits, _ and single /"),
        (Role.ROBOT, "ä", (), "NAME is 'ä'; use letters, digits, _ and -"),
        (Role.OPERATOR, "../../anna", (), "NAME is '../../anna'; use letters, digits, _ and -"),
        (Role.OPERATOR, "a" * 60, (), "which is longer than 64 characters; give a shorter one"),
        (Role.OPERATOR, "anna", ("10.0.0.300",), "--host is '10.0.0.300'; give the name or IP address of a machine"),
        (Role.ROUTER, "b", ("0.0.0.0",), "--host is '0.0.0.0'; give an address that others can connect to"),
        (Role.ROUTER, "b", ("*.example.org",), "--host is '*.example.org'; give the name or IP address"),
    ],
)
def test_names_and_hosts_that_cannot_be_used(
    authority: CertificateAuthority, role: Role, name: str, hosts: tuple[str, ...], says: str
) -> None:
    with pytest.raises(SpecError) as refused:
        authority.new_member(role, name, hosts)
    assert says in str(refused.value)


@pytest.mark.parametrize(
    "router",
    ["tcp/127.0.0.1:7461", "quic/127.0.0.1:7461", "tls/0.0.0.0:7461", "tls/127.0.0.1", "tls/::1:7461", "tls/a:65535"],
)
def test_endpoints_that_cannot_be_the_routers(folder: Path, router: str) -> None:
    with pytest.raises(SpecError, match=r"--router is .*; give a"):
        CertificateAuthority.create(folder, router)
    assert files(folder) == {}


def test_an_authority_is_never_overwritten(authority: CertificateAuthority) -> None:
    before = files(authority.folder)
    shutil.move(authority.folder / "authority", authority.folder.parent)
    with pytest.raises(SpecError, match=r"ca\.pem is there already; use it, or, for another router, move /"):
        CertificateAuthority.create(authority.folder)
    shutil.move(authority.folder.parent / "authority", authority.folder)
    assert files(authority.folder) == before


def test_a_name_is_issued_once_and_never_again_when_revoked(authority: CertificateAuthority) -> None:
    anna = issued(authority, Role.OPERATOR, "anna")
    with pytest.raises(SpecError, match=r"operator\.anna is issued already; renew or revoke it"):
        issued(authority, Role.OPERATOR, "anna")
    shutil.copytree(anna.folder, authority.folder.parent / "elsewhere")
    authority.revoke(authority.named("operator.anna"))
    assert not anna.folder.exists()
    with pytest.raises(SpecError, match=r"operator\.anna is revoked; give a name that is new"):
        issued(authority, Role.OPERATOR, "anna")
    with pytest.raises(SpecError, match=r"operator\.anna is revoked; issue another identity"):
        authority.named("operator.anna")
    shutil.copy(authority.folder / "access.json", authority.folder.parent / "elsewhere")
    with pytest.raises(SpecError, match=r"operator\.anna .* is revoked in access list 4; issue another"):
        Identity.load(authority.folder.parent / "elsewhere")


def test_the_router_is_not_revoked(authority: CertificateAuthority) -> None:
    with pytest.raises(SpecError, match="cannot be revoked: it is the router that heeds the access list"):
        authority.revoke(authority.named("router.main"))


def test_all_that_expires_soon_is_renewed_for_as_long_as_before(
    authority: CertificateAuthority, monkeypatch: pytest.MonkeyPatch
) -> None:
    later(monkeypatch)  # holds the clock: certificates tell whole seconds
    old, young = issued(authority, Role.OPERATOR, "anna"), issued(authority, Role.OPERATOR, "bert", days=90.0)
    later(monkeypatch, days=20, minutes=-1)
    assert authority.due() == []
    later(monkeypatch, minutes=2)
    assert [each.name for each in authority.due()] == ["router.main", "operator.anna"]
    number = authority.access.number
    authority.renew(authority.due())
    new = Identity.load(old.folder)
    assert authority.due() == []
    assert new.expires - old.expires == timedelta(days=20, minutes=1)
    assert new.certificate_pem != old.certificate_pem and old.key.read_bytes() != old._key_pem
    assert Identity.load(young.folder).certificate_pem == young.certificate_pem
    assert new.access.number == number


@pytest.mark.parametrize(
    "harm",
    [
        lambda folder: (folder / "key.pem").write_bytes(b""),
        lambda folder: (folder / "certificate.pem").unlink(),
        lambda folder: (folder / "access.json").write_text("{"),
        lambda folder: (folder / "key.pem").chmod(0o644),
        lambda folder: shutil.copy(folder.parent / "router.main" / "key.pem", folder),
        shutil.rmtree,
    ],
)
def test_renewing_mends_an_identity(
    authority: CertificateAuthority, anna: Identity, harm: Callable[[Path], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(identity, "_LOOKS", 2)
    harm(anna.folder)
    assert [each.name for each in authority.due()] == ["operator.anna"]
    authority.renew(authority.due())
    assert Identity.load(anna.folder).name == "operator.anna"
    assert stat.S_IMODE(anna.key.stat().st_mode) == 0o600


@pytest.mark.parametrize("room", [100, 300])
def test_without_room_nothing_changes(authority: CertificateAuthority, anna: Identity, room: int) -> None:
    """A key has 240 bytes, a certificate 640."""
    before, (soft, hard) = files(authority.folder), resource.getrlimit(resource.RLIMIT_FSIZE)
    for change in (
        lambda: authority.renew([authority.named(anna.name)]),
        lambda: issued(authority, Role.ROBOT, "tt2"),
        lambda: authority.revoke(authority.named(anna.name)),
    ):
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
        try:
            with pytest.raises(SpecError, match=r"cannot be written .*; make room"):
                change()
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert files(authority.folder) == before
    assert CertificateAuthority(authority.folder).access == authority.access
    assert Identity.load(anna.folder) == anna


@pytest.mark.parametrize("room", [100, 640])
def test_without_room_there_is_no_half_an_authority(folder: Path, room: int) -> None:
    """The authority's certificate has 620 bytes, the router's 670."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
    try:
        with pytest.raises(SpecError, match=r"cannot be written .*; make room"):
            CertificateAuthority.create(folder)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert files(folder) == {}
    assert CertificateAuthority.create(folder).access.member("router.main")


def test_those_who_issue_at_once_lose_nothing(authority: CertificateAuthority) -> None:
    def issue(name: str) -> None:
        with CertificateAuthority.changing(authority.folder) as own:
            issued(own, Role.OPERATOR, name)

    names = [f"o{number}" for number in range(8)]
    with ThreadPoolExecutor(len(names)) as pool:
        list(pool.map(issue, names))
    access = CertificateAuthority(authority.folder).access
    assert {each.name for each in access.members} == {"router.main", *(f"operator.{name}" for name in names)}
    assert access.number == 10
    assert all(Identity.load(path).access == access for path in (authority.folder / "identities").iterdir())


def test_with_the_authoritys_key_away_all_else_works(authority: CertificateAuthority, anna: Identity) -> None:
    (authority.folder / "authority").rename(authority.folder.parent / "safe")
    again = CertificateAuthority(authority.folder)
    assert Identity.load(anna.folder) == anna
    for change in (
        lambda: again.renew([again.named(anna.name)]),
        lambda: again.revoke(again.named(anna.name)),
        lambda: issued(again, Role.ROBOT, "tt2"),
    ):
        with pytest.raises(SpecError, match=r"key\.pem is not here; put it back, or, if it is lost, make a new"):
            change()


def test_what_keeps_an_authority_from_signing(
    authority: CertificateAuthority, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    key = authority.folder / "authority" / "key.pem"
    right, other = key.read_bytes(), CertificateAuthority.create(tmp_path / "other").folder / "authority" / "key.pem"
    for content, mode, says in (
        (right, 0o640, "is open to others .mode 640.; chmod 600"),
        (b"nonsense", 0o600, "is not a private key"),
        (other.read_bytes(), 0o600, r"is not the key of ca\.pem; put the right one back"),
    ):
        key.write_bytes(content)
        key.chmod(mode)
        with pytest.raises(SpecError, match=says):
            issued(authority, Role.ROBOT, "tt2")
    key.write_bytes(right)
    with monkeypatch.context() as patched:
        later(patched, days=-1)
        with pytest.raises(SpecError, match="by the clock; set this machine's clock"):
            issued(authority, Role.ROBOT, "tt2")
    with monkeypatch.context() as patched:
        later(patched, days=3650)
        with pytest.raises(SpecError, match=r"ca\.pem expired on .* by the clock; make a new authority: "):
            issued(authority, Role.ROBOT, "tt2")
    issued(authority, Role.ROBOT, "tt2")


def test_a_clock_that_was_set_back_since_the_last_change(
    authority: CertificateAuthority, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patched:
        later(patched, days=2)
        issued(authority, Role.OPERATOR, "anna")
    with pytest.raises(SpecError, match=r"access\.json was changed on .* by the clock; set this machine's clock"):
        issued(authority, Role.ROBOT, "tt2")


def test_a_certificate_does_not_outlive_its_authority(
    authority: CertificateAuthority, monkeypatch: pytest.MonkeyPatch
) -> None:
    later(monkeypatch, days=3640)
    assert issued(authority, Role.ROBOT, "tt2").expires == authority.certificate.not_valid_after_utc


@pytest.mark.parametrize("content", ["", "{}", '{"access": {}, "signature": ""}', "[" * 100_000])
def test_a_damaged_list_names_where_there_are_copies(authority: CertificateAuthority, content: str) -> None:
    (authority.folder / "access.json").write_text(content)
    with pytest.raises(SpecError, match=r"put back a backup, or the latest identities/\*/access\.json"):
        CertificateAuthority(authority.folder)
    shutil.copy(authority.folder / "identities" / "router.main" / "access.json", authority.folder)
    assert CertificateAuthority(authority.folder).access == authority.access


def test_a_whole_system_has_identities_from_nothing_and_keeps_them(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = issued_for_system(folder, ["tt2", "field/tt3"])
    assert first["field/tt3"].name == "robot.field.tt3"
    assert first[Role.PLANNER].name == "planner.main"
    assert {each.role for each in first.values()} == set(Role)
    assert issued_for_system(folder, ["tt2", "field/tt3"]) == first
    assert issued_for_system(folder, ["tt4"])["tt4"].access.number == first["tt2"].access.number + 1
    with pytest.raises(SpecError, match="'planner'; give a robot another name"):
        issued_for_system(folder, ["planner"])
    later(monkeypatch, days=25)
    renewed = issued_for_system(folder, ["tt2"])
    assert all(each.expires - certificates.now() > timedelta(days=29) for each in renewed.values())


def test_a_system_runs_on_while_the_authoritys_key_is_away(
    folder: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    first = issued_for_system(folder, ["tt2"])
    shutil.rmtree(folder / "authority")
    later(monkeypatch, days=25)
    assert issued_for_system(folder, ["tt2"]) == first
    assert "the authority's key is not here; renew soon: router.main, planner.main" in caplog.text
    later(monkeypatch, days=6)
    with pytest.raises(SpecError, match=r"router\.main .* expired on .*; run `touchline keys renew router\.main`"):
        issued_for_system(folder, ["tt2"])
