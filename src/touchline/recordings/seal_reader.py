"""Reader of the seals of a recording, and of the bytes between them."""

import json
import struct
from base64 import b64decode
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO, Final, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Metadata
from mcap.writer import MCAP0_MAGIC

from touchline.recordings.recorded import Damage
from touchline.recordings.sealing import SEAL, SEAL_FORMAT, seal_record

_HEAD: Final = struct.Struct("<BQ")
_NAME: Final = struct.pack("<I", len(SEAL)) + SEAL.encode()
"""Beginning of the content of a seal's record."""
_LARGEST_SEAL_BYTES: Final = 64 * 1024
_BLOCK_BYTES: Final = 1024 * 1024


class SealRecord(NamedTuple):
    """Metadata record with the name of a seal, not verified.

    Attributes:
        text: The signed text.
        signature: Its signature, in DER.
        certificate_pem: The signer's certificate; empty if the record has none.
    """

    text: bytes
    signature: bytes
    certificate_pem: bytes


@dataclass(frozen=True)
class Seal:
    """Text of a seal.

    Attributes:
        file: Random id of the file.
        number: Number of the seal in it, from 0.
        messages: Messages in the file before the seal.
        log_time_ns: Latest log time among them.
        sha256: Hash of the bytes from the beginning of the seal before it, or of the file.
        before: Id of the file before this one in the recording; only in the first seal.
        end: What ends with the file, "part" or "recording"; empty but in the last seal.
        rest_sha256: Hash of the bytes behind the last seal.
    """

    file: str
    number: int
    messages: int
    log_time_ns: int
    sha256: str
    before: str = ""
    end: str = ""
    rest_sha256: str = ""

    @classmethod
    def parse(cls, text: bytes) -> "Seal":
        """Parse the text of a seal.

        Raises:
            Damage: It is none, or of an unknown format.
        """
        try:
            given: Any = json.loads(text)
            if given.pop(SEAL) != SEAL_FORMAT:
                raise Damage(f"a seal of an unknown format; this Touchline reads {SEAL_FORMAT}")
            seal = cls(**{name: given[name] for name in cls.__annotations__ if name in given})
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
            if isinstance(error, Damage):
                raise
            raise Damage("a seal that cannot be read") from error
        if any(type(getattr(seal, name)) is not kind for name, kind in cls.__annotations__.items()):
            raise Damage("a seal that cannot be read")
        return seal


def blocks(stream: BinaryIO, size_bytes: int) -> Iterator[tuple[bytes, SealRecord | None]]:
    """Yield all bytes of an MCAP file in their order, the records with the name of a seal by themselves.

    Behind a record that cannot be one the next seal is looked for.

    Args:
        stream: The file, at its beginning.
        size_bytes: Its size.
    """
    at = len(MCAP0_MAGIC)
    yield stream.read(at), None
    while at < size_bytes:
        head = stream.read(_HEAD.size)
        opcode, length = _HEAD.unpack(head) if len(head) == _HEAD.size else (0, size_bytes)
        end = at + _HEAD.size + length
        if end > size_bytes:
            end = _next_seal(stream, at + 1, size_bytes)
        elif opcode == Opcode.METADATA and length <= _LARGEST_SEAL_BYTES:
            record = head + stream.read(length)
            yield record, _parsed(record) if record.startswith(_NAME, _HEAD.size) else None
            at = end
            continue
        stream.seek(at)
        while at < end and (block := stream.read(min(_BLOCK_BYTES, end - at))):
            yield block, None
            at += len(block)
        if at < end:  # cut off meanwhile
            return


def file_id(path: Path) -> str:
    """Return the id that the first seal of a recording's file gives it, not verified; empty without seals."""
    try:
        with path.open("rb") as stream:
            for _, record in blocks(stream, path.stat().st_size):
                if record is not None:
                    return Seal.parse(record.text).file
    except (OSError, Damage):
        pass
    return ""


def _next_seal(stream: BinaryIO, begin: int, size_bytes: int) -> int:
    """Return where the next record begins that has the name of a seal; the file's size if there is none."""
    at, overlap = begin, _HEAD.size + len(_NAME)
    while at < size_bytes:
        stream.seek(at)
        block = stream.read(_BLOCK_BYTES + overlap)
        found = block.find(_NAME, _HEAD.size)
        while found >= 0:
            if block[found - _HEAD.size] == Opcode.METADATA:
                return at + found - _HEAD.size
            found = block.find(_NAME, found + 1)
        at += _BLOCK_BYTES
    return size_bytes


def _parsed(record: bytes) -> SealRecord:
    """Parse a seal's record; one that no recorder writes becomes a seal without a signature."""
    try:
        values = dict(Metadata.read(ReadDataStream(BytesIO(record[_HEAD.size :]))).metadata)
        signature = b64decode(values["signature"].strip(), validate=True)
        certificate = values.get("certificate", "").encode()
        if seal_record(values) == record and len(values) == (3 if certificate else 2):
            return SealRecord(values["seal"].encode(), signature, certificate)
    except (KeyError, ValueError, McapError, struct.error):
        pass
    return SealRecord(b"", b"", b"")
