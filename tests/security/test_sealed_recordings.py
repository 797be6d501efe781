"""Sealed recordings: whatever is done to their files is found."""

import json
import random
import shutil
import struct
from base64 import b64decode
from hashlib import sha256
from pathlib import Path

import pytest
from mcap.opcode import Opcode
from mcap.reader import make_reader

from tests.bridge.mutations import mutated, records
from tests.bridge.said import messages
from tests.security.signers import Authority, KeySigner
from touchline.recordings.reader import read_summary
from touchline.recordings.recorder import Recorder
from touchline.recordings.salvage import salvage
from touchline.recordings.seal_verification import SealedPart, SealVerdict, verify_recording
from touchline.recordings.sealing import SEAL, Signer
from touchline.schemas.cdr import encode
from touchline.schemas.errors import TouchlineError

AUTHORITY = Authority()
#: Ticks between two flushes, of a recording of five seconds.
FLUSH_TICKS, TICKS = 25, 500


def recorder_of(path: Path, signer: Signer | None, *, ticks: int = TICKS, continues: tuple[Path, ...] = ()) -> Recorder:
    """A recorder, not finished, that was flushed as the bridge does."""
    recorder = Recorder(path, continues=continues, signer=signer)
    for number, (topic, message) in enumerate(messages(ticks)):
        recorder.write(topic.name, encode(message), number)
        if number % (2 * FLUSH_TICKS) == 0:
            recorder.flush()
    return recorder


@pytest.fixture(scope="module")
def original(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sealed") / "session.mcap"
    recorder_of(path, KeySigner(AUTHORITY)).finish()
    return path


def verified(path: Path, authority: Authority = AUTHORITY) -> SealedPart:
    """The verification of a recording of one file."""
    (part,) = verify_recording(path, authority.check).files
    return part


def seals(data: bytes) -> list[tuple[int, int]]:
    """(start, end) of each seal's record."""
    name = struct.pack("<I", len(SEAL)) + SEAL.encode()
    return [(a, b) for a, b in records(data) if data[a] == Opcode.METADATA and data.startswith(name, a + 9)]


def changed(path: Path, original: Path, data: bytes) -> SealedPart:
    """The verification of a copy that has these bytes."""
    copy = path / "session.mcap"
    copy.write_bytes(data)
    assert copy.read_bytes() != original.read_bytes()
    return verified(copy)


def test_a_recording_is_as_recorded(original: Path) -> None:
    found = verified(original)
    assert (found.verdict, found.signer, found.until_s) == (SealVerdict.AS_RECORDED, "recorder.main", 4.99)
    held = read_summary(original)
    assert found.messages == held.messages and not held.problem and held.complete
    assert found.text == f"as recorded by recorder.main, {found.messages:,} messages, sealed to the end"
    assert len(seals(original.read_bytes())) >= 6  # at least one a second
    assert not any(SEAL in name for name in held.metadata)


def test_other_readers_see_the_same_messages(original: Path, tmp_path: Path) -> None:
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


def test_a_changed_byte_is_told_with_its_time(original: Path, tmp_path: Path) -> None:
    data = bytearray(original.read_bytes())
    at = seals(bytes(data))[3][0] - 20
    data[at] ^= 1
    found = changed(tmp_path, original, bytes(data))
    ((from_s, to_s),) = found.changed_s
    assert found.verdict is SealVerdict.CHANGED and 1.0 < from_s < to_s < 4.0 and to_s - from_s < 1.5
    assert f"between {from_s:.1f} s and {to_s:.1f} s" in found.text


@pytest.mark.parametrize("number", range(64))
def test_no_change_goes_unseen(original: Path, tmp_path: Path, number: int) -> None:
    """Bits, lengths, orders, kinds and whole records changed, repeated, cut out or cut off."""
    data = mutated(original.read_bytes(), number)
    if data != original.read_bytes():
        assert changed(tmp_path, original, data).verdict is not SealVerdict.AS_RECORDED


def test_every_kind_of_record_counts(original: Path, tmp_path: Path) -> None:
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
                assert changed(tmp_path, original, attempt).verdict is not SealVerdict.AS_RECORDED, data[start]


def test_a_file_that_is_cut_is_good_up_to_its_last_seal(original: Path, tmp_path: Path) -> None:
    data = original.read_bytes()
    for (_, first_end), (second, _) in zip(seals(data)[1:], seals(data)[2:], strict=False):
        found = changed(tmp_path, original, data[: random.Random(first_end).randrange(first_end, second)])
        assert found.verdict is SealVerdict.CUT_SHORT and "what follows is not sealed" in found.text
    assert 2.5 < found.until_s < 4.99


def test_a_recorder_that_was_killed_leaves_a_file_that_is_cut_short(tmp_path: Path) -> None:
    recorder_of(tmp_path / "a.mcap", KeySigner(AUTHORITY))
    found = verified(tmp_path / "a.mcap")
    assert found.verdict is SealVerdict.CUT_SHORT and found.until_s > 3.5 and found.messages > 1000


def test_an_end_that_looks_complete_is_told(original: Path, tmp_path: Path) -> None:
    """The last seals and messages replaced by a sound end."""
    data = original.read_bytes()
    end = data[next(start for start, _ in records(data) if data[start] == Opcode.DATA_END) :]
    assert changed(tmp_path, original, data[: seals(data)[3][1]] + end).verdict is SealVerdict.CUT_SHORT
    assert changed(tmp_path, original, data[: seals(data)[-1][0]] + end).verdict is SealVerdict.CUT_SHORT


def test_a_seal_of_another_file_does_not_fit(original: Path, tmp_path: Path) -> None:
    """The same session, recorded twice by the same signer, to one file out of both."""
    other = recorder_of(tmp_path / "other.mcap", KeySigner(AUTHORITY)).finish().path.read_bytes()
    data = original.read_bytes()
    here, there = seals(data), seals(other)
    swapped = data[: here[2][0]] + other[slice(*there[2])] + data[here[2][1] :]
    for attempt in (
        swapped,
        data[: here[2][1]] + other[there[2][1] :],
        data[: here[0][0]] + other[slice(*there[0])] + data[here[0][1] :],
        data[: here[-1][0]] + other[there[-1][0] :],
        data + other,
    ):
        assert changed(tmp_path, original, attempt).verdict is SealVerdict.CHANGED


def test_seals_in_another_order_are_told(original: Path, tmp_path: Path) -> None:
    data = original.read_bytes()
    (_, a), (_, b), (_, c) = seals(data)[2:5]
    found = changed(tmp_path, original, data[:a] + data[b:c] + data[a:b] + data[c:])
    assert found.verdict is SealVerdict.CHANGED and len(found.changed_s) >= 2


def test_a_copy_is_not_signed(original: Path, tmp_path: Path) -> None:
    copy = salvage(original, tmp_path / "copy.mcap").path
    assert verified(copy).verdict is SealVerdict.NOT_SIGNED


def test_other_authorities_and_other_roles_are_not_trusted(original: Path, tmp_path: Path) -> None:
    assert verified(original, Authority()).verdict is SealVerdict.NOT_TRUSTED
    by_observer = recorder_of(tmp_path / "a.mcap", KeySigner(AUTHORITY, "observer.anna")).finish().path
    found = verified(by_observer)
    assert found.verdict is SealVerdict.NOT_TRUSTED and "observer.anna, who is no recorder" in found.text


def test_a_certificate_is_renewed_while_recording(tmp_path: Path) -> None:
    signer = KeySigner(AUTHORITY)
    recorder = recorder_of(tmp_path / "a.mcap", signer, ticks=300)
    signer.renew()
    recorder.finish()
    assert verified(tmp_path / "a.mcap").verdict is SealVerdict.AS_RECORDED


def test_a_key_that_cannot_be_used_ends_the_recording(tmp_path: Path) -> None:
    signer = KeySigner(AUTHORITY)
    recorder = recorder_of(tmp_path / "a.mcap", signer, ticks=300)

    def sign(_: bytes) -> bytes:
        raise TouchlineError("the key is gone")

    signer.sign = sign  # type: ignore[method-assign]
    assert "the key is gone" in recorder.finish().problem
    assert verified(tmp_path / "a.mcap").verdict is SealVerdict.CUT_SHORT


def test_parts_belong_together(tmp_path: Path) -> None:
    signer, first = KeySigner(AUTHORITY), tmp_path / "a.mcap"
    parts = [first, tmp_path / "a.part2.mcap", tmp_path / "a.part3.mcap"]
    for number, part in enumerate(parts):
        recorder_of(part, signer, ticks=100, continues=tuple(parts[:number])).finish(goes_on=part != parts[-1])

    def verdicts() -> list[SealVerdict]:
        return [each.verdict for each in verify_recording(first, AUTHORITY.check).files]

    assert verdicts() == [SealVerdict.AS_RECORDED] * 3
    assert verified(parts[1]).text.endswith("one part of a longer recording")
    parts[2].rename(tmp_path / "away.mcap")
    assert verdicts() == [SealVerdict.AS_RECORDED, SealVerdict.CUT_SHORT]
    shutil.move(tmp_path / "away.mcap", parts[1])
    assert verdicts() == [SealVerdict.AS_RECORDED, SealVerdict.CHANGED]


def test_the_description_is_enough_to_verify_a_file(original: Path) -> None:
    """docs/reference/recordings.md, followed step by step."""
    data, at, begin, number, certificate = original.read_bytes(), 8, 0, 0, b""
    while True:
        opcode, length = struct.unpack_from("<BQ", data, at)
        end = at + 9 + length
        texts, place = [], at + 9
        if opcode == 0x0C:
            (size,) = struct.unpack_from("<I", data, place)
            name, place = data[place + 4 : place + 4 + size], place + 8 + size
            while name == b"touchline_seal" and place < end:
                (size,) = struct.unpack_from("<I", data, place)
                texts.append(data[place + 4 : place + 4 + size])
                place += 4 + size
        if texts:
            values = dict(zip(texts[::2], texts[1::2], strict=True))
            certificate = values.get(b"certificate", certificate)
            assert AUTHORITY.check(certificate, values[b"seal"], b64decode(values[b"signature"])) == "recorder.main"
            seal = json.loads(values[b"seal"])
            assert seal["number"] == number and seal["sha256"] == sha256(data[begin:at]).hexdigest()
            begin, number = at, number + 1
            if "end" in seal:
                assert seal["rest_sha256"] == sha256(data[end:]).hexdigest()
                return
        at = end
