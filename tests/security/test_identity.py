"""An identity is loaded only if it is whole, private and valid, and what it signs is known as its own."""

import json
import pickle
import shutil
import threading
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path

import pytest

from touchline.schemas.errors import SpecError
from touchline.schemas.roles import Role
from touchline.security import access_list, certificates, identity
from touchline.security.authority import CertificateAuthority
from touchline.security.identity import Identity, verify


@pytest.fixture
def other(tmp_path: Path) -> Identity:
    """The router of another authority."""
    return Identity.load(CertificateAuthority.create(tmp_path / "other").folder / "identities" / "router.main")


def test_it_is_found_by_folder_and_by_name(
    authority: CertificateAuthority, anna: Identity, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    with pytest.raises(SpecError, match=r"operator\.anna is no identity; give the folder of an identity, or a name in"):
        Identity.load("operator.anna")
    shutil.copytree(authority.folder, tmp_path / "config" / "touchline" / "keys")
    named = Identity.load("operator.anna")
    assert named.folder == tmp_path / "config" / "touchline" / "keys" / "identities" / "operator.anna"
    assert Identity.load(str(anna.folder)) == Identity.load(anna.folder) == anna
    assert named.access == anna.access
    assert anna.certificate.read_bytes() == anna.certificate_pem


@pytest.mark.parametrize(
    ("harm", "says"),
    [
        (lambda folder: (folder / "key.pem").unlink(), r"key\.pem cannot be read .No such file"),
        (lambda folder: (folder / "key.pem").chmod(0o644), r"key\.pem is open to others .mode 644.; chmod 600 /"),
        (lambda folder: folder.chmod(0o750), "is open to others .mode 750.; chmod -R go= /"),
        (lambda folder: (folder / "key.pem").write_bytes(b"\xff"), r"key\.pem is not a private key"),
        (lambda folder: (folder / "certificate.pem").write_bytes(b"\xff"), r"certificate\.pem is not a certificate"),
        (lambda folder: (folder / "access.json").unlink(), r"access\.json cannot be read"),
        (
            lambda folder: shutil.copy(folder.parent / "router.main" / "key.pem", folder),
            r"key\.pem is not the key of certificate\.pem; copy the whole folder anew",
        ),
    ],
)
def test_an_identity_that_is_not_whole_or_private(
    anna: Identity, harm: Callable[[Path], None], says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(identity, "_LOOKS", 2)
    harm(anna.folder)
    with pytest.raises(SpecError, match=says):
        Identity.load(anna.folder)


def test_another_users_key_is_refused(anna: Identity, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.geteuid", lambda: 12345)
    with pytest.raises(SpecError, match=r"belongs to the user with id .*; chown -R 12345 /"):
        Identity.load(anna.folder)


def test_files_of_another_authority(anna: Identity, other: Identity) -> None:
    for name, says in (
        ("ca.pem", r"certificate\.pem is not signed by the authority in ca\.pem"),
        ("access.json", r"access\.json is damaged, forged, or of another authority"),
    ):
        kept = (anna.folder / name).read_bytes()
        shutil.copy(other.folder / name, anna.folder)
        with pytest.raises(SpecError, match=says):
            Identity.load(anna.folder)
        (anna.folder / name).write_bytes(kept)


def test_expired_and_of_the_future(anna: Identity, monkeypatch: pytest.MonkeyPatch) -> None:
    made = certificates.now()
    monkeypatch.setattr(certificates, "now", lambda: made + timedelta(days=31))
    says = r"operator\.anna .* expired on .* UTC, and it is .* by the clock; run `touchline keys renew operator"
    with pytest.raises(SpecError, match=says):
        Identity.load(anna.folder)
    monkeypatch.setattr(certificates, "now", lambda: made - timedelta(days=1))
    with pytest.raises(SpecError, match=r"is valid from .* by the clock; set this machine's clock"):
        Identity.load(anna.folder)


def test_it_can_be_loaded_while_it_is_renewed(authority: CertificateAuthority, anna: Identity) -> None:
    done = threading.Event()

    def renew() -> None:
        try:
            for _ in range(20):
                authority.renew([authority.named(anna.name)])
        finally:
            done.set()

    renewing = threading.Thread(target=renew)
    renewing.start()
    while not done.is_set():
        Identity.load(anna.folder)
    renewing.join()
    assert Identity.load(anna.folder).certificate_pem != anna.certificate_pem


def test_a_signature_names_its_signer_whatever_was_renewed_since(
    authority: CertificateAuthority, anna: Identity
) -> None:
    authority.renew([authority.named(anna.name)])
    ca = anna.authority.read_bytes()
    signature = pickle.loads(pickle.dumps(anna)).sign(b"data")
    assert verify(anna.certificate_pem, b"data", signature, ca) == "operator.anna"
    assert "PRIVATE" not in repr(anna)


def test_forged_signatures(authority: CertificateAuthority, anna: Identity, other: Identity) -> None:
    ca, signature = anna.authority.read_bytes(), anna.sign(b"data")
    router = Identity.load(authority.folder / "identities" / "router.main")
    for certificate, data, given, trusted, says in (
        (anna.certificate_pem, b"date", signature, ca, "the signature of operator.anna is not of this data"),
        (anna.certificate_pem, b"data", b"", ca, "the signature of operator.anna is not of this data"),
        (router.certificate_pem, b"data", signature, ca, "the signature of router.main is not of this data"),
        (other.certificate_pem, b"data", other.sign(b"data"), ca, "the certificate of router.main is not issued by"),
        (b"", b"data", signature, ca, "the signer's certificate is not a certificate"),
    ):
        with pytest.raises(SpecError, match=says):
            verify(certificate, data, given, trusted)


def test_a_member_cannot_sign_a_list(authority: CertificateAuthority, anna: Identity) -> None:
    """Nor does a signature by the authority's key of a list count as one of data, or the reverse."""
    path, ca = anna.folder / "access.json", anna.authority.read_bytes()
    key = certificates.read_key(anna.key.read_bytes(), "key")
    path.write_bytes(access_list.signed(anna.access, key))
    with pytest.raises(SpecError, match="damaged, forged, or of another authority"):
        access_list.load(path, ca)
    signing = certificates.read_key((authority.folder / "authority" / "key.pem").read_bytes(), "key")
    signature = certificates.sign(signing, "data", b"x")
    assert certificates.is_signed(authority.certificate, "data", b"x", signature)
    assert not certificates.is_signed(authority.certificate, "access list", b"x", signature)


def test_a_list_that_was_altered_or_is_older(anna: Identity) -> None:
    path, ca = anna.folder / "access.json", anna.authority.read_bytes()
    content = json.loads(path.read_text())
    path.write_text(json.dumps(content))  # laid out otherwise, the same list
    assert access_list.load(path, ca, at_least=anna.access.number) == anna.access
    with pytest.raises(SpecError, match=r"access\.json is list 3, older than list 4 seen before; copy it anew"):
        access_list.load(path, ca, at_least=4)
    content["access"]["number"] = 9
    path.write_text(json.dumps(content))
    with pytest.raises(SpecError, match="damaged, forged, or of another authority"):
        access_list.load(path, ca)


def test_a_list_that_the_authority_should_not_have_signed(authority: CertificateAuthority, anna: Identity) -> None:
    """Fields of another version are refused by name, not half understood."""
    signing = certificates.read_key((authority.folder / "authority" / "key.pem").read_bytes(), "key")
    good = anna.access.model_dump(mode="json")
    for change, says in (
        ({"members": [{"name": "robot.x", "role": "operator", "hosts": ["localhost"]}]}, "begins with operator."),
        ({"members": [{"name": "robot.x", "role": "robot", "hosts": ["a"], "namespace": "x"}]}, "give an endpoint"),
        ({"revoked": ["operator.anna"]}, "name each member once, and none that is revoked"),
        ({"router": "tcp/127.0.0.1:1"}, "router is 'tcp/127.0.0.1:1'; give an endpoint like tls/10.0.0.1:7461"),
        ({"issued": "2026-01-01T00:00:00"}, "issued"),
        ({"more": 1}, "more is not a known field"),
    ):
        raw = {**good, **change}
        text = access_list.signed(_Raw(raw), signing)  # type: ignore[arg-type]
        (anna.folder / "access.json").write_bytes(text)
        with pytest.raises(SpecError, match=says):
            Identity.load(anna.folder)


class _Raw:
    """Fields that no `AccessList` would take."""

    def __init__(self, fields: dict[str, object]) -> None:
        self._fields = fields

    def model_dump(self, mode: str) -> dict[str, object]:
        return self._fields


def test_only_routers_and_robots_can_be_connected_to(authority: CertificateAuthority, anna: Identity) -> None:
    from cryptography import x509
    from cryptography.x509.oid import ExtendedKeyUsageOID

    def uses(path: Path) -> set[x509.ObjectIdentifier]:
        certificate = x509.load_pem_x509_certificate(path.read_bytes())
        return set(certificate.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value)

    both = {ExtendedKeyUsageOID.CLIENT_AUTH, ExtendedKeyUsageOID.SERVER_AUTH}
    robot = authority.new_member(Role.ROBOT, "tt2")
    authority.issue([robot])
    assert uses(authority.folder / "identities" / "router.main" / "certificate.pem") == both
    assert uses(authority.folder_of(robot) / "certificate.pem") == both
    assert uses(anna.certificate) == {ExtendedKeyUsageOID.CLIENT_AUTH}
