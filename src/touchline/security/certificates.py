"""X.509 certificates of an authority and of those whom it names, and signatures by their keys (ECDSA, P-256)."""

import ipaddress
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from typing import Final

from cryptography import x509
from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives.asymmetric.ec import (
    ECDSA,
    SECP256R1,
    EllipticCurvePrivateKey,
    EllipticCurvePublicKey,
    generate_private_key,
)
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    load_pem_private_key,
)
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from touchline.schemas.errors import SpecError

#: Certificates are valid from a little earlier on, for machines whose clocks are behind.
CLOCK_TOLERANCE: Final = timedelta(minutes=5)
_AUTHORITY_LIFE: Final = timedelta(days=3650)
#: Precedes signed data: what is signed for one purpose is worth nothing for another, such as TLS.
_SIGNED: Final = b"touchline signature 1: "


def now() -> datetime:
    """Return the time, UTC."""
    return datetime.now(UTC)


def new_authority() -> tuple[bytes, bytes]:
    """Return the key and the certificate of a new authority, as PEM."""
    key = generate_private_key(SECP256R1())
    name = _common_name("Touchline certificate authority")
    builder = _builder(name, key.public_key(), now() + _AUTHORITY_LIFE).issuer_name(name)
    usage = x509.KeyUsage(
        digital_signature=True,  # of access lists
        key_cert_sign=True,
        crl_sign=False,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )
    builder = (
        builder.add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(usage, critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
    )
    return key_pem(key), certificate_pem(builder.sign(key, SHA256()))


def issue(
    authority: tuple[EllipticCurvePrivateKey, x509.Certificate],
    name: str,
    hosts: Sequence[str],
    life: timedelta,
    *,
    listens: bool,
) -> tuple[bytes, bytes]:
    """Return a new key and its certificate, as PEM.

    Args:
        authority: Key and certificate of the authority.
        name: Common name.
        hosts: Names and IP addresses of the machine.
        life: Time until the certificate expires; it does not outlive the authority's.
        listens: Whether others connect to its owner. A certificate without this cannot pass for the router's.
    """
    signing, ca = authority
    key = generate_private_key(SECP256R1())
    end = min(now() + life, ca.not_valid_after_utc)
    uses = [ExtendedKeyUsageOID.CLIENT_AUTH, *([ExtendedKeyUsageOID.SERVER_AUTH] if listens else [])]
    builder = (
        _builder(_common_name(name), key.public_key(), end)
        .issuer_name(ca.subject)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.ExtendedKeyUsage(uses), critical=False)
        .add_extension(x509.SubjectAlternativeName([_general_name(host) for host in hosts]), critical=False)
        .add_extension(x509.AuthorityKeyIdentifier.from_issuer_public_key(signing.public_key()), critical=False)
    )
    return key_pem(key), certificate_pem(builder.sign(signing, SHA256()))


def _builder(name: x509.Name, key: EllipticCurvePublicKey, end: datetime) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(name)
        .public_key(key)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now() - CLOCK_TOLERANCE)
        .not_valid_after(end)
    )


def _common_name(name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])


def _general_name(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def key_pem(key: EllipticCurvePrivateKey) -> bytes:
    """Return a private key as PEM (PKCS #8), without a passphrase."""
    return key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())


def certificate_pem(certificate: x509.Certificate) -> bytes:
    """Return a certificate as PEM."""
    return certificate.public_bytes(Encoding.PEM)


def read_certificate(pem: bytes, source: str) -> x509.Certificate:
    """Return the certificate written in a text.

    Args:
        pem: The text.
        source: Its file or other origin, for errors.

    Raises:
        SpecError: It is none of ours.
    """
    try:
        certificate = x509.load_pem_x509_certificate(pem)
        name_of(certificate)
        if isinstance(certificate.public_key(), EllipticCurvePublicKey):
            return certificate
    except (ValueError, IndexError, UnsupportedAlgorithm) as error:
        raise SpecError(source, "", "is not a certificate (PEM)", "put the file back, or issue it anew") from error
    raise SpecError(source, "", "has a key of another kind than P-256", "use certificates of `touchline keys`")


def read_key(pem: bytes, source: str) -> EllipticCurvePrivateKey:
    """Return the private key written in a text.

    Args:
        pem: The text.
        source: Its file, for errors.

    Raises:
        SpecError: It is none of ours.
    """
    try:
        key = load_pem_private_key(pem, None)
    except TypeError as error:
        raise SpecError(source, "", "is protected by a passphrase", "remove that (openssl pkey)") from error
    except (ValueError, UnsupportedAlgorithm) as error:
        raise SpecError(source, "", "is not a private key (PEM)", "put the file back, or issue it anew") from error
    if isinstance(key, EllipticCurvePrivateKey):
        return key
    raise SpecError(source, "", "is a key of another kind than P-256", "use keys of `touchline keys`")


def name_of(certificate: x509.Certificate) -> str:
    """Return a certificate's common name.

    Raises:
        IndexError: It has none.
    """
    return str(certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)[0].value)


def fits(key: EllipticCurvePrivateKey, certificate: x509.Certificate) -> bool:
    """Return whether a private key is that of a certificate."""
    return key.public_key() == certificate.public_key()


def issued_by(certificate: x509.Certificate, authority: x509.Certificate) -> bool:
    """Return whether an authority has signed a certificate."""
    try:
        certificate.verify_directly_issued_by(authority)
    except (ValueError, TypeError, InvalidSignature):
        return False
    return True


def life_of(certificate: x509.Certificate) -> timedelta:
    """Return the time that a certificate was made for."""
    return certificate.not_valid_after_utc - certificate.not_valid_before_utc - CLOCK_TOLERANCE


def check_time(certificate: x509.Certificate, source: str, remedy: str) -> None:
    """Refuse a certificate that has expired, or that is of the future.

    Args:
        certificate: It.
        source: What it is of, for errors.
        remedy: What to do if it has expired.

    Raises:
        SpecError: It is not valid now.
    """
    by_the_clock = f"and it is {shown(now())} by the clock"
    if now() > certificate.not_valid_after_utc:
        raise SpecError(source, "", f"expired on {shown(certificate.not_valid_after_utc)}, {by_the_clock}", remedy)
    if now() < certificate.not_valid_before_utc:
        problem = f"is valid from {shown(certificate.not_valid_before_utc)} on, {by_the_clock}"
        raise SpecError(source, "", problem, "set this machine's clock")


def shown(time: datetime) -> str:
    """Return a time for people: ``2026-12-27 09:30 UTC``."""
    return f"{time:%Y-%m-%d %H:%M} UTC"


def fingerprint(certificate: x509.Certificate) -> str:
    """Return the first 64 bits of a certificate's SHA-256: ``3f9a 77c2 01de 4b8c``."""
    digits = certificate.fingerprint(SHA256()).hex()
    return " ".join(digits[at : at + 4] for at in range(0, 16, 4))


def sign(key: EllipticCurvePrivateKey, purpose: str, data: bytes) -> bytes:
    """Return a signature of data, which is good for one purpose only."""
    return key.sign(_SIGNED + purpose.encode() + b"\0" + data, ECDSA(SHA256()))


def is_signed(certificate: x509.Certificate, purpose: str, data: bytes, signature: bytes) -> bool:
    """Return whether the key of a certificate has signed data for a purpose."""
    key = certificate.public_key()
    assert isinstance(key, EllipticCurvePublicKey)  # by `read_certificate`
    try:
        key.verify(signature, _SIGNED + purpose.encode() + b"\0" + data, ECDSA(SHA256()))
    except InvalidSignature:
        return False
    return True
