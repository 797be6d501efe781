"""Signers of recordings, and the check of their signatures, with keys of their own."""

from datetime import UTC, datetime, timedelta

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding
from cryptography.x509.oid import NameOID

from touchline.schemas.errors import TouchlineError

_BEGIN = datetime(2026, 1, 1, tzinfo=UTC)


def _named(name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])


class Authority:
    """Certificate authority."""

    def __init__(self) -> None:
        self._key = ec.generate_private_key(ec.SECP256R1())
        self.pem = self.certificate("authority", self._key.public_key()).public_bytes(Encoding.PEM)

    def certificate(self, name: str, key: ec.EllipticCurvePublicKey) -> x509.Certificate:
        builder = x509.CertificateBuilder(_named("authority"), _named(name), key, x509.random_serial_number())
        lasting = builder.not_valid_before(_BEGIN).not_valid_after(_BEGIN + timedelta(days=9999))
        return lasting.sign(self._key, SHA256())

    def check(self, certificate_pem: bytes, data: bytes, signature: bytes) -> str:
        try:
            certificate = x509.load_pem_x509_certificate(certificate_pem)
            key = certificate.public_key()
            assert isinstance(key, ec.EllipticCurvePublicKey)
            certificate.verify_directly_issued_by(x509.load_pem_x509_certificate(self.pem))
            key.verify(signature, data, ec.ECDSA(SHA256()))
        except (InvalidSignature, ValueError) as error:
            raise TouchlineError("a signature that is not of this authority's certificate") from error
        (name,) = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
        return str(name.value)


class KeySigner:
    """Signer with a certificate of the authority."""

    def __init__(self, authority: Authority, name: str = "recorder.main") -> None:
        self._authority, self._name = authority, name
        self.renew()

    def renew(self) -> None:
        """Take a new key and a new certificate."""
        self._key = ec.generate_private_key(ec.SECP256R1())
        certificate = self._authority.certificate(self._name, self._key.public_key())
        self.certificate_pem = certificate.public_bytes(Encoding.PEM)

    def sign(self, data: bytes) -> bytes:
        return self._key.sign(data, ec.ECDSA(SHA256()))
