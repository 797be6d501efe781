"""An identity on a secured bus: a folder with a key, its certificate, the authority's, and the access list."""

import time
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Final, Self

from touchline.schemas.errors import SpecError
from touchline.schemas.roles import Role
from touchline.schemas.user_folders import keys_folder
from touchline.security.access_list import ACCESS_FILE, AccessList, load
from touchline.security.key_files import check_private, read_file

if TYPE_CHECKING:
    from cryptography.x509 import Certificate

CERTIFICATE_FILE: Final = "certificate.pem"
KEY_FILE: Final = "key.pem"
AUTHORITY_FILE: Final = "ca.pem"
IDENTITIES: Final = "identities"
_PURPOSE: Final = "data"
#: A key and its certificate are replaced one right after the other; a reader between them looks again.
_LOOKS, _LOOK_AGAIN_S = 40, 0.05


@dataclass(frozen=True)
class Identity:
    """An identity, as its folder was when it was loaded; the files may be renewed since.

    Attributes:
        folder: The folder.
        name: Common name of the certificate: ``operator.anna``.
        role: What it may do.
        namespace: Of a robot; empty for others.
        expires: End of the certificate, UTC.
        access: The access list.
        certificate_pem: The certificate, to be shown to others; what `sign` signs is checked by it.
    """

    folder: Path
    name: str
    role: Role
    namespace: str
    expires: datetime
    access: AccessList
    certificate_pem: bytes = field(repr=False)
    _key_pem: bytes = field(repr=False)

    @property
    def certificate(self) -> Path:
        """File of the certificate."""
        return self.folder / CERTIFICATE_FILE

    @property
    def key(self) -> Path:
        """File of the private key."""
        return self.folder / KEY_FILE

    @property
    def authority(self) -> Path:
        """File of the authority's certificate."""
        return self.folder / AUTHORITY_FILE

    @property
    def robots(self) -> tuple[str, ...]:
        """Namespaces of the robots that it may act for: a robot's own, or all on the access list."""
        all_robots = tuple(member.namespace for member in self.access.members if member.role is Role.ROBOT)
        return (self.namespace,) if self.namespace else all_robots

    @classmethod
    def load(cls, path_or_name: str | Path) -> Self:
        """Return the identity in a folder.

        Args:
            path_or_name: The folder, or the name of an identity in the default folder of keys.

        Raises:
            SpecError: Its files are missing, damaged, open to others, do not belong together, or are not valid now.
            MissingExtra: The package cryptography is not installed.
        """
        from touchline.security import certificates

        folder = _folder_of(path_or_name)
        check_private(folder)
        ca_pem = read_file(folder / AUTHORITY_FILE)
        ca = certificates.read_certificate(ca_pem, str(folder / AUTHORITY_FILE))
        key_pem, certificate = _pair(folder)
        name = certificates.name_of(certificate)
        renewal = f"run `touchline keys renew {name}` in the folder of keys, and copy this folder anew if it is a copy"
        if not certificates.issued_by(certificate, ca):
            problem = f"is not signed by the authority in {AUTHORITY_FILE}"
            raise SpecError(str(folder / CERTIFICATE_FILE), "", problem, "copy the whole folder anew")
        certificates.check_time(ca, str(folder / AUTHORITY_FILE), "make a new authority: touchline keys init")
        certificates.check_time(certificate, f"{name} ({folder})", renewal)
        access = load(folder / ACCESS_FILE, ca_pem)
        member = access.member(name)
        if member is None:
            problem = f"{'is revoked' if name in access.revoked else 'is not listed'} in access list {access.number}"
            raise SpecError(f"{name} ({folder})", "", problem, "issue another identity: touchline keys issue")
        return cls(
            folder=folder,
            name=name,
            role=member.role,
            namespace=member.namespace,
            expires=certificate.not_valid_after_utc,
            access=access,
            certificate_pem=certificates.certificate_pem(certificate),
            _key_pem=key_pem,
        )

    def sign(self, data: bytes) -> bytes:
        """Return a signature of data, which `verify` checks by `certificate_pem`."""
        from touchline.security import certificates

        return certificates.sign(certificates.read_key(self._key_pem, str(self.key)), _PURPOSE, data)


def verify(certificate_pem: bytes, data: bytes, signature: bytes, ca_pem: bytes) -> str:
    """Return the name of the identity that has signed data.

    That its certificate may have expired since does not matter.

    Args:
        certificate_pem: Certificate of the identity.
        data: What was signed.
        signature: By :meth:`Identity.sign`.
        ca_pem: Certificate of the authority that is trusted.

    Raises:
        SpecError: A certificate cannot be read, the authority has not issued it, or the signature is not of the data.
        MissingExtra: The package cryptography is not installed.
    """
    from touchline.security import certificates

    certificate = certificates.read_certificate(certificate_pem, "the signer's certificate")
    ca = certificates.read_certificate(ca_pem, "the authority's certificate")
    name = certificates.name_of(certificate)
    if not certificates.issued_by(certificate, ca):
        problem = f"is not issued by the authority {certificates.fingerprint(ca)}"
        raise SpecError(f"the certificate of {name}", "", problem, "do not trust it, or give its authority's ca.pem")
    if not certificates.is_signed(certificate, _PURPOSE, data, signature):
        raise SpecError(f"the signature of {name}", "", "is not of this data", "do not trust it")
    return name


def _folder_of(path_or_name: str | Path) -> Path:
    known = keys_folder() / IDENTITIES
    if "/" not in str(path_or_name) and (known / path_or_name).is_dir():
        return known / path_or_name
    folder = Path(path_or_name)
    if not folder.is_dir():
        remedy = f"give the folder of an identity, or a name in {known} (touchline keys list)"
        raise SpecError(str(path_or_name), "", "is no identity", remedy)
    return folder


def _pair(folder: Path) -> "tuple[bytes, Certificate]":
    """Return a private key, PEM, and its certificate.

    Raises:
        SpecError: They cannot be used, or do not fit.
    """
    from touchline.security import certificates

    check_private(folder / KEY_FILE)
    for _ in range(_LOOKS):
        key_pem, certificate_text = read_file(folder / KEY_FILE), read_file(folder / CERTIFICATE_FILE)
        key = certificates.read_key(key_pem, str(folder / KEY_FILE))
        certificate = certificates.read_certificate(certificate_text, str(folder / CERTIFICATE_FILE))
        if certificates.fits(key, certificate):
            return key_pem, certificate
        time.sleep(_LOOK_AGAIN_S)
    remedy = "copy the whole folder anew, or run `touchline keys renew` in the folder of keys"
    raise SpecError(str(folder / KEY_FILE), "", f"is not the key of {CERTIFICATE_FILE}", remedy)
