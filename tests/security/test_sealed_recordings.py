"""Sealed recordings: whatever is done to their files is found."""

import json
import random
import shutil
import struct
from base64 import b64decode
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric.ec import ECDSA, EllipticCurvePublicKey
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.x509 import load_pem_x509_certificate
from mcap.opcode import Opcode
from mcap.reader import make_reader

from tests.bridge.mutations import mutated, records
from tests.bridge.said import messages
from tests.bridge.test_recorder import full_disk
from tests.bridge.test_session import Said
from touchline.recordings import sealing
from touchline.recordings.part_limits import PartLimits
from touchline.recordings.reader import read_summary
from touchline.recordings.recorder import Recorder
from touchline.recordings.recording_file import RecordingError
from touchline.recordings.salvage import salvage
from touchline.recordings.seal_verification import SealedPart, SealVerdict, SignatureCheck, verify_recording
from touchline.recordings.sealing import SEAL, Signer
from touchline.schemas.cdr import encode
from touchline.schemas.errors import TouchlineError
from touchline.schemas.roles import Role
from touchline.schemas.topics import DEFAULT_NAMESPACE
from touchline.security.authority import CertificateAuthority
from touchline.security.identity import Identity, verify
from touchline.services.bridge.recording_folder import RecordingFolder
from touchline.services.bridge.recording_session import RecordingSession

#: Messages between two flushes.
FLUSH_MESSAGES = 50


def recorder_of(path: Path, signer: Signer | None, *, ticks: int = 500, continues: tuple[Path, ...] = ()) -> Recorder:
    """A recorder of five seconds, not finished, that was flushed as the bridge does."""
    recorder = Recorder(path, continues=continues, signer=signer)
    for number, (topic, message) in enumerate(messages(ticks)):
        recorder.write(topic.name, encode(message), number)
        if number % FLUSH_MESSAGES == 0:
            recorder.flush()
    return recorder


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of keys with a recorder and an observer."""
    folder = tmp_path_factory.mktemp("keys")
    CertificateAuthority.create(folder)
    with CertificateAuthority.changing(folder) as authority:
        authority.issue([authority.new_member(Role.BRIDGE, "main"), authority.new_member(Role.OBSERVER, "anna")])
    return folder


@pytest.fixture(scope="module")
def signer(keys: Path) -> Identity:
    return Identity.load(keys / "identities" / "bridge.main")


def trusting(keys: Path) -> SignatureCheck:
    return partial(verify, ca_pem=(keys / "ca.pem").read_bytes())


Verified = Callable[[Path], SealedPart]
Altered = Callable[[bytes], SealedPart]


@pytest.fixture(scope="module")
def verified(keys: Path) -> Verified:
    """Verifies a recording of one file."""

    def verified_file(path: Path) -> SealedPart:
        (part,) = verify_recording(path, trusting(keys)).files
        return part

    return verified_file


@pytest.fixture(scope="module")
def original(signer: Identity, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorder_of(tmp_path_factory.mktemp("sealed") / "session.mcap", signer).finish().path


@pytest.fixture
def altered(original: Path, tmp_path: Path, verified: Verified) -> Altered:
    """Verifies a copy of the original that has other bytes."""

    def verified_copy(data: bytes) -> SealedPart:
        assert data != original.read_bytes()
        copy = tmp_path / original.name
        copy.write_bytes(data)
        return verified(copy)

    return verified_copy


def seals(data: bytes) -> list[tuple[int, int]]:
    """(start, end) of each seal's record."""
    name = struct.pack("<I", len(SEAL)) + SEAL.encode()
    return [(a, b) for a, b in records(data) if data[a] == Opcode.METADATA and data.startswith(name, a + 9)]


def test_a_recording_is_as_recorded(original: Path, verified: Verified) -> None:
    found = verified(original)
    assert (found.verdict, found.signer, found.until_s) == (SealVerdict.AS_RECORDED, "bridge.main", 4.99)
    held = read_summary(original)
    assert found.messages == held.messages and not held.problem and held.complete
    assert found.text == f"as recorded by bridge.main, {found.messages:,} messages, sealed to the end"
    assert len(seals(original.read_bytes())) >= 6  # the first, one each second, the last
    assert not any(SEAL in name for name in held.metadata)


def test_other_readers_see_the_same_messages(original: Path, tmp_path: Path, verified: Verified) -> None:
    plain = recorder_of(tmp_path / "plain.mcap", None).finish().path
    assert not seals(plain.read_bytes()) and verified(plain).verdict is SealVerdict.NOT_SIGNED
    found = []
    for path in (original, plain):
        with path.open("rb") as stream:
            found.append([(m.log_time, m.sequence, m.data) for _, _, m in make_reader(stream).iter_messages()])
            stream.seek(0)
            names = {record.name for record in make_reader(stream).iter_metadata()}
            assert (SEAL in names) is (path == original)
    assert found[0] == found[1]


def test_a_changed_byte_is_told_with_its_time(original: Path, altered: Altered) -> None:
    data = bytearray(original.read_bytes())
    data[seals(bytes(data))[3][0] - 20] ^= 1
    found = altered(bytes(data))
    ((from_s, to_s),) = found.changed_s
    assert found.verdict is SealVerdict.CHANGED and 1.0 < from_s < to_s < 4.0 and to_s - from_s < 1.5
    assert f"between {from_s:.1f} s and {to_s:.1f} s" in found.text


@pytest.mark.parametrize("number", range(64))
def test_no_change_goes_unseen(original: Path, altered: Altered, number: int) -> None:
    """Bits, lengths, orders, kinds and whole records changed, repeated, cut out or cut off."""
    data = mutated(original.read_bytes(), number)
    if data != original.read_bytes():
        assert altered(data).verdict is not SealVerdict.AS_RECORDED


def test_every_kind_of_record_counts(original: Path, altered: Altered) -> None:
    """One record of each kind, and every seal, left out, changed in its last byte, and moved behind the next one."""
    data = original.read_bytes()
    places = records(data)
    behind = dict(zip(places, [*places[1:], places[-1]], strict=True))
    for start, end in {*{data[place[0]]: place for place in places}.values(), *seals(data)}:
        without = data[:start] + data[end:]
        edited = data[: end - 1] + bytes((data[end - 1] ^ 1,)) + data[end:]
        next_end = behind[start, end][1]
        moved = data[:start] + data[end:next_end] + data[start:end] + data[next_end:]
        for attempt in (without, edited, moved):
            if attempt != data:
                assert altered(attempt).verdict is not SealVerdict.AS_RECORDED, data[start]


def test_a_file_that_is_cut_is_good_up_to_its_last_seal(original: Path, altered: Altered) -> None:
    data = original.read_bytes()
    for (_, first_end), (second, _) in zip(seals(data)[1:], seals(data)[2:], strict=False):
        found = altered(data[: random.Random(first_end).randrange(first_end, second)])
        assert found.verdict is SealVerdict.CUT_SHORT and "what follows is not sealed" in found.text
    assert 2.5 < found.until_s < 4.99


def test_what_is_recorded_while_sim_time_stands_is_sealed_too(
    tmp_path: Path, signer: Identity, verified: Verified, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sealing, "_SEAL_EVERY_S", 0.0)
    recorder = recorder_of(tmp_path / "a.mcap", signer, ticks=1)
    recorder.flush()
    assert verified(tmp_path / "a.mcap").messages == read_summary(tmp_path / "a.mcap").messages > 0


def test_a_recorder_that_was_killed_leaves_a_file_that_is_cut_short(
    tmp_path: Path, signer: Identity, verified: Verified
) -> None:
    recorder_of(tmp_path / "a.mcap", signer)
    found = verified(tmp_path / "a.mcap")
    assert found.verdict is SealVerdict.CUT_SHORT and found.until_s > 3.5 and found.messages > 1000


def test_an_end_that_looks_complete_is_told(original: Path, altered: Altered) -> None:
    """The last seals and messages replaced by a sound end."""
    data = original.read_bytes()
    end = data[next(start for start, _ in records(data) if data[start] == Opcode.DATA_END) :]
    assert altered(data[: seals(data)[3][1]] + end).verdict is SealVerdict.CUT_SHORT
    assert altered(data[: seals(data)[-1][0]] + end).verdict is SealVerdict.CUT_SHORT


def test_a_seal_of_another_file_does_not_fit(
    original: Path, tmp_path: Path, signer: Identity, altered: Altered
) -> None:
    """The same session, recorded twice by the same signer, to one file out of both."""
    other = recorder_of(tmp_path / "other.mcap", signer).finish().path.read_bytes()
    data = original.read_bytes()
    here, there = seals(data), seals(other)
    for attempt in (
        data[: here[2][0]] + other[slice(*there[2])] + data[here[2][1] :],
        data[: here[2][1]] + other[there[2][1] :],
        data[: here[0][0]] + other[slice(*there[0])] + data[here[0][1] :],
        data[: here[-1][0]] + other[there[-1][0] :],
        data + other,
    ):
        assert altered(attempt).verdict is SealVerdict.CHANGED


def test_seals_in_another_order_are_told(original: Path, altered: Altered) -> None:
    data = original.read_bytes()
    (_, a), (_, b), (_, c) = seals(data)[2:5]
    found = altered(data[:a] + data[b:c] + data[a:b] + data[c:])
    assert found.verdict is SealVerdict.CHANGED and len(found.changed_s) >= 2


def test_a_copy_is_not_signed(original: Path, tmp_path: Path, verified: Verified) -> None:
    assert verified(salvage(original, tmp_path / "copy.mcap").path).verdict is SealVerdict.NOT_SIGNED


def test_other_authorities_and_other_roles_are_not_trusted(
    original: Path, keys: Path, tmp_path: Path, verified: Verified
) -> None:
    CertificateAuthority.create(tmp_path / "other")
    assert verify_recording(original, trusting(tmp_path / "other")).verdict is SealVerdict.NOT_TRUSTED
    observer = Identity.load(keys / "identities" / "observer.anna")
    found = verified(recorder_of(tmp_path / "a.mcap", observer).finish().path)
    assert found.verdict is SealVerdict.NOT_TRUSTED and "observer.anna, who records nothing" in found.text


@dataclass
class Renewable:
    """Signer whose key and certificate may be renewed."""

    identity: Identity

    @property
    def certificate_pem(self) -> bytes:
        return self.identity.certificate_pem

    def sign(self, data: bytes) -> bytes:
        return self.identity.sign(data)


def test_a_certificate_is_renewed_while_recording(
    keys: Path, tmp_path: Path, signer: Identity, verified: Verified
) -> None:
    renewable = Renewable(signer)
    recorder = recorder_of(tmp_path / "a.mcap", renewable, ticks=300)
    with CertificateAuthority.changing(keys) as authority:
        authority.renew([member for member in authority.access.members if member.name == signer.name])
    renewable.identity = Identity.load(signer.folder)
    recorder.finish()
    assert renewable.certificate_pem != signer.certificate_pem
    assert verified(tmp_path / "a.mcap").verdict is SealVerdict.AS_RECORDED


class Lost(Renewable):
    """Signer whose key is lost after the first seal."""

    seals = 0

    def sign(self, data: bytes) -> bytes:
        self.seals += 1
        if self.seals > 1:
            raise TouchlineError("the key is gone")
        return super().sign(data)


def test_a_key_that_cannot_be_used_ends_the_recording(tmp_path: Path, signer: Identity, verified: Verified) -> None:
    report = recorder_of(tmp_path / "a.mcap", Lost(signer), ticks=20).finish()
    assert "the key is gone" in report.problem and report.messages > 20
    assert verified(tmp_path / "a.mcap").verdict is SealVerdict.CUT_SHORT


def test_a_full_disk_leaves_a_file_that_is_cut_short(
    original: Path, tmp_path: Path, signer: Identity, verified: Verified
) -> None:
    size = original.stat().st_size
    for limit in (size // 2, size - 6000, size - 100, size - 1):
        path = tmp_path / f"{limit}.mcap"
        with full_disk(limit):
            recorder = Recorder(path, signer=signer)
            with suppress(RecordingError):
                for number, (topic, message) in enumerate(messages(500)):
                    recorder.write(topic.name, encode(message), number)
                    if number % FLUSH_MESSAGES == 0:
                        recorder.flush()
            report = recorder.finish()
        assert "the recording ends before it" in report.problem and read_summary(path).problem == ""
        assert verified(path).verdict is SealVerdict.CUT_SHORT


def test_the_bridge_s_parts_belong_together_over_its_restart(keys: Path, tmp_path: Path, signer: Identity) -> None:
    folder = RecordingFolder(tmp_path, signer=signer)
    first = folder.recorder(tmp_path / "a.mcap", (DEFAULT_NAMESPACE,), ())
    session = RecordingSession(first, [Said()], PartLimits(max_s=1.0))
    for tenth in range(25):
        session.pump(tenth / 10)
    assert [part.name for part in session.parts] == ["a.mcap", "a.part2.mcap", "a.part3.mcap"]
    after = folder.recorder(tmp_path / "a.part4.mcap", (DEFAULT_NAMESPACE,), session.parts)
    RecordingSession(after, [Said()], continues=session.parts).finish()
    verdicts = [each.verdict for each in verify_recording(tmp_path / "a.mcap", trusting(keys)).files]
    whole, cut = SealVerdict.AS_RECORDED, SealVerdict.CUT_SHORT
    assert verdicts == [whole, whole, cut, whole]


def test_parts_belong_together(keys: Path, tmp_path: Path, signer: Identity, verified: Verified) -> None:
    first = tmp_path / "a.mcap"
    parts = [first, tmp_path / "a.part2.mcap", tmp_path / "a.part3.mcap"]
    for number, part in enumerate(parts):
        recorder_of(part, signer, ticks=100, continues=tuple(parts[:number])).finish(goes_on=part != parts[-1])

    def verdicts() -> list[SealVerdict]:
        return [each.verdict for each in verify_recording(first, trusting(keys)).files]

    assert verdicts() == [SealVerdict.AS_RECORDED] * 3
    assert verified(parts[1]).text.endswith("one part of a longer recording")
    parts[2].rename(tmp_path / "away.mcap")
    assert verdicts() == [SealVerdict.AS_RECORDED, SealVerdict.CUT_SHORT]
    shutil.move(tmp_path / "away.mcap", parts[1])
    assert verdicts() == [SealVerdict.AS_RECORDED, SealVerdict.CHANGED]


def test_the_description_is_enough_to_verify_a_file(original: Path, keys: Path) -> None:
    """docs/reference/recordings.md, followed step by step."""
    data, authority = original.read_bytes(), load_pem_x509_certificate((keys / "ca.pem").read_bytes())
    at, begin, number, key = 8, 0, 0, None
    while True:
        opcode, length = struct.unpack_from("<BQ", data, at)
        texts, place, end = [], at + 9, at + 9 + length
        if opcode == 0x0C and data.startswith(b"\x0e\0\0\0touchline_seal", place):
            place += 4 + 14 + 4  # the name, and the size of the map
            while place < end:
                (size,) = struct.unpack_from("<I", data, place)
                texts.append(data[place + 4 : place + 4 + size])
                place += 4 + size
            values = dict(zip(texts[::2], texts[1::2], strict=True))
            if b"certificate" in values:
                certificate = load_pem_x509_certificate(values[b"certificate"])
                certificate.verify_directly_issued_by(authority)
                assert certificate.subject.rfc4514_string() == "CN=bridge.main"
                key = certificate.public_key()
            assert isinstance(key, EllipticCurvePublicKey)
            signed = b"touchline signature 1: data\0" + values[b"seal"]
            key.verify(b64decode(values[b"signature"].strip()), signed, ECDSA(SHA256()))
            seal = json.loads(values[b"seal"])
            assert seal["number"] == number and seal["sha256"] == sha256(data[begin:at]).hexdigest()
            begin, number = at, number + 1
            if "end" in seal:
                assert seal["end"] == "recording" and seal["rest_sha256"] == sha256(data[end:]).hexdigest()
                return
        at = end
