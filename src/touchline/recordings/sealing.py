"""Seals of a recording: signed hashes of its bytes, by which a file that was changed is told from what was recorded.

docs/reference/recordings.md describes them for other programs.
"""

import json
import secrets
from base64 import b64encode
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from typing import Any, Final, Protocol

from mcap.data_stream import RecordBuilder
from mcap.records import Metadata
from mcap.writer import Writer

from touchline.recordings.recording_file import RecordingError, RecordingFile
from touchline.schemas.errors import TouchlineError

SEAL: Final = "touchline_seal"
"""Name of the metadata records; also the field of a seal's text that has the version of the format."""
SEAL_FORMAT: Final = 1
_SEAL_EVERY_NS: Final = 1_000_000_000
_SIGNATURE_CHARACTERS: Final = 96
"""Base64 of 72 bytes, the longest signature of ECDSA P-256: the last seal has to have a size known beforehand."""
_NO_HASH: Final = "0" * 64


class Signer(Protocol):
    """Identity that signs a recording."""

    @property
    def certificate_pem(self) -> bytes:
        """Certificate of the key that `sign` uses."""

    def sign(self, data: bytes) -> bytes:
        """Return the signature of ``data``, ECDSA P-256 with SHA-256 in DER.

        Raises:
            TouchlineError: The key cannot be used.
        """


def seal_record(values: dict[str, str]) -> bytes:
    """Return the MCAP record of a seal with these values."""
    builder = RecordBuilder()
    Metadata(name=SEAL, metadata=values).write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


class SealedFile(RecordingFile):
    """Output file of a recording with seals between its records.

    A seal has the hash of all bytes since the beginning of the seal before it, and the last one also that of the bytes
    behind it. So whatever is changed or left out, a seal does not fit or is missing.

    Args:
        path: File to create; it must not exist.
        signer: Identity that signs.
        before: Id of the file before this one in the same recording; empty if there is none.

    Raises:
        RecordingError: It exists or cannot be created.
    """

    def __init__(self, path: Path, signer: Signer, before: str = "") -> None:
        super().__init__(path)
        self._signer = signer
        self._before = before
        self._id = secrets.token_hex(16)
        self._number = 0
        self._certificate = b""
        self._since_seal = sha256()
        self._sealed_bytes = 0
        self._next_seal_ns = 0
        self._held: list[bytes] | None = None

    def write(self, data: bytes) -> int:
        """Append whole records.

        Raises:
            RecordingError: As `RecordingFile.write`.
        """
        if self._held is not None:
            self._held.append(data)
            return len(data)
        written = super().write(data)
        self._since_seal.update(data)
        return written

    def tell(self) -> int:
        """Return the number of bytes written."""
        return super().tell() + sum(map(len, self._held or ()))

    def seal(self, writer: Writer, messages: int, log_time_ns: int) -> None:
        """Seal the records so far, unless there are none since the last seal or that was less than a second ago.

        Args:
            writer: Writer of this file, without a chunk in progress.
            messages: Number of messages in the file.
            log_time_ns: Latest log time among them; 0 if there are none.

        Raises:
            RecordingError: It cannot be written or signed.
        """
        if log_time_ns < self._next_seal_ns or self.tell() == self._sealed_bytes:
            return
        values = self._signed(self._text(messages, log_time_ns), self._new_certificate())
        self._since_seal = sha256()  # of the seal itself, and what comes behind it
        writer.add_metadata(SEAL, values)
        self._sealed_bytes = self.tell()
        self._next_seal_ns = log_time_ns + _SEAL_EVERY_NS

    def finish(self, writer: Writer, messages: int, log_time_ns: int, *, goes_on: bool) -> None:
        """Write the last seal and the index.

        The index has the place and size of the seal, which has the index's hash: so they are made in memory, the seal
        without its values first.

        Args:
            writer: As `seal`.
            messages: As `seal`.
            log_time_ns: As `seal`.
            goes_on: Whether the recording goes on in another file.

        Raises:
            RecordingError: As `seal`.
        """
        certificate = self._new_certificate()
        text = self._text(messages, log_time_ns, end="part" if goes_on else "recording", rest_sha256=_NO_HASH)
        self._held = []
        writer.add_metadata(SEAL, {"seal": text, "signature": " " * _SIGNATURE_CHARACTERS, **certificate})
        blank = b"".join(self._held)
        self._held = [blank]
        writer.finish()  # type: ignore[no-untyped-call]
        rest, self._held = self._held[1:], None
        values = self._signed(text.replace(_NO_HASH, sha256(b"".join(rest)).hexdigest()), certificate)
        for data in (seal_record(values), *rest):
            self.write(data)

    def _text(self, messages: int, log_time_ns: int, **more: str) -> str:
        fields: dict[str, Any] = {
            SEAL: SEAL_FORMAT,
            "file": self._id,
            "number": self._number,
            "time": datetime.now(UTC).isoformat(timespec="milliseconds"),
            "messages": messages,
            "log_time_ns": log_time_ns,
            "sha256": self._since_seal.hexdigest(),
        }
        if not self._number:
            fields["before"] = self._before
        self._number += 1
        return json.dumps(fields | more)

    def _new_certificate(self) -> dict[str, str]:
        """Return the signer's certificate as values of a seal; nothing while it is that of the seal before."""
        certificate = self._signer.certificate_pem
        if certificate == self._certificate:
            return {}
        self._certificate = certificate
        return {"certificate": certificate.decode()}

    def _signed(self, text: str, certificate: dict[str, str]) -> dict[str, str]:
        try:
            signature = self._signer.sign(text.encode())
        except TouchlineError as error:
            raise RecordingError(f"{self.path}: cannot be signed: {error}") from error
        return {"seal": text, "signature": b64encode(signature).decode().ljust(_SIGNATURE_CHARACTERS), **certificate}
