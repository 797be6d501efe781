"""Verification of a sealed recording: whether its files are what was recorded."""

import stat
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from hashlib import sha256
from pathlib import Path
from typing import Any, Final

from touchline.recordings.parts import with_followers
from touchline.recordings.recorded import Damage
from touchline.recordings.recording_file import RecordingError
from touchline.recordings.seal_reader import Seal, SealRecord, blocks
from touchline.schemas.errors import TouchlineError
from touchline.schemas.roles import Role

#: Raises `TouchlineError` unless the signature (third) of data (second) is by the certificate's key (first) and that of
#: the trusted authority; returns the signer's name.
SignatureCheck = Callable[[bytes, bytes, bytes], str]
_SPANS_SHOWN: Final = 3


class SealVerdict(StrEnum):
    """Result of a verification, from the best to the worst."""

    AS_RECORDED = "as recorded"
    CUT_SHORT = "cut short"
    NOT_SIGNED = "not signed"
    NOT_TRUSTED = "not trusted"
    CHANGED = "changed"


@dataclass(frozen=True)
class SealedPart:
    """Verification of one file of a recording.

    Attributes:
        verdict: The result.
        text: The same in a sentence.
        signer: Name of the identity that signed; empty if there is none to be trusted.
        messages: Messages up to the last seal, by that.
        until_s: Latest log time up to there (s).
        changed_s: Stretches of log time (s) whose records are not those that were recorded.
    """

    path: Path
    verdict: SealVerdict
    text: str
    signer: str = ""
    messages: int = 0
    until_s: float = 0.0
    changed_s: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class Verification:
    """Verification of a recording.

    Attributes:
        verdict: That of the file with the worst.
        files: Its files, in order.
    """

    verdict: SealVerdict
    files: tuple[SealedPart, ...]

    @property
    def good(self) -> bool:
        """True if it is what was recorded, all of it."""
        return self.verdict is SealVerdict.AS_RECORDED

    def as_json(self) -> dict[str, Any]:
        """Return it as a JSON object."""
        return {"verdict": self.verdict, "files": [asdict(each) | {"path": str(each.path)} for each in self.files]}


def verify_recording(path: Path, check: SignatureCheck) -> Verification:
    """Verify the seals of a recording, its next parts included.

    Args:
        path: An MCAP file; other recordings have no seals.
        check: Verifies a signature and its certificate.

    Raises:
        RecordingError: A file cannot be read, or is none.
    """
    try:
        walks = [_walked(each, check) for each in with_followers(path)]
    except OSError as error:
        raise RecordingError(f"{path}: cannot read the recording: {error.strerror}") from error
    files = []
    for number, walk in enumerate(walks):
        before = walks[number - 1] if number else None
        files.append(walk.result(before, last=number == len(walks) - 1))
    worst = max((each.verdict for each in files), key=list(SealVerdict).index)
    return Verification(worst, tuple(files))


def _walked(path: Path, check: SignatureCheck) -> "_Walk":
    found = path.stat()
    if not stat.S_ISREG(found.st_mode):
        raise RecordingError(f"{path}: cannot be verified: it is no file; give the files of a folder one by one")
    walk = _Walk(path, check)
    with path.open("rb") as stream:
        for block, record in blocks(stream, found.st_size):
            walk.take(block, record)
    return walk


@dataclass
class _Walk:
    """Verification of a file from its beginning to its end.

    Attributes:
        first: Its first seal, if there is one with a good signature.
        last: The latest of these.
        bad: Why a seal was not accepted, of the first one that was not.
        changed_ns: From and to, log times of the seals around what does not fit.
        since_seal: Hash of the bytes since the beginning of `last`.
        rest: Hash of the bytes behind the seal that ends the file.
    """

    path: Path
    check: SignatureCheck
    first: Seal | None = None
    last: Seal | None = None
    signer: str = ""
    certificate_pem: bytes = b""
    bad: str = ""
    untrusted: bool = False
    changed_ns: list[tuple[int, int]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.since_seal = sha256()
        self.rest = sha256()

    def take(self, block: bytes, record: SealRecord | None) -> None:
        """Take the next bytes of the file, and the seal in them, if any."""
        if self.last is not None and self.last.end:
            self.rest.update(block)
            return
        if record is not None:
            try:
                self._accept(record)
            except (Damage, TouchlineError) as error:
                self.bad = self.bad or str(error)
            else:
                self.since_seal = sha256()
        self.since_seal.update(block)

    def _accept(self, record: SealRecord) -> None:
        """Take a seal.

        Raises:
            Damage: It is none of this file.
            TouchlineError: Its signature is not to be trusted.
        """
        certificate = record.certificate_pem or self.certificate_pem
        if not certificate:
            raise Damage("the first seal, which has the signer's certificate, is missing or damaged")
        self.untrusted = self.first is None
        signer = self.check(certificate, record.text, record.signature)
        if signer.partition(".")[0] != Role.BRIDGE:
            raise TouchlineError(f"it is signed by {signer}, who records nothing")
        self.untrusted = False
        seal = Seal.parse(record.text)
        last = self.last
        if self.first is None or last is None:
            self.first, self.signer = seal, signer
        elif (seal.file, signer) != (self.first.file, self.signer):
            raise Damage("a seal of another recording")
        if seal.number != (0 if last is None else last.number + 1) or seal.sha256 != self.since_seal.hexdigest():
            span_ns = 0 if last is None else last.log_time_ns, seal.log_time_ns
            self.changed_ns.append((min(span_ns), max(span_ns)))
        self.certificate_pem, self.last = certificate, seal

    def result(self, before: "_Walk | None", *, last: bool) -> SealedPart:
        """Return the verification, once all is taken.

        Args:
            before: The file before this one in the recording, if any.
            last: Whether there is none behind it.
        """
        seal = self.last
        if seal is None:
            if not self.bad:
                return SealedPart(self.path, SealVerdict.NOT_SIGNED, "not signed")
            verdict = SealVerdict.NOT_TRUSTED if self.untrusted else SealVerdict.CHANGED
            return SealedPart(self.path, verdict, f"{verdict}: {self.bad}")
        changed_s = tuple((from_ns / 1e9, to_ns / 1e9) for from_ns, to_ns in self.changed_ns)
        verdict, reason = self._verdict(seal, before, last=last)
        until_s = seal.log_time_ns / 1e9
        return SealedPart(self.path, verdict, reason, self.signer, seal.messages, until_s, changed_s)

    def _verdict(self, seal: Seal, before: "_Walk | None", *, last: bool) -> tuple[SealVerdict, str]:
        assert self.first is not None
        count = f"{seal.messages:,} message{'s' if seal.messages != 1 else ''}"
        until_s = seal.log_time_ns / 1e9
        own = f"as recorded by {self.signer}"
        if self.changed_ns:
            spans = [f"between {a / 1e9:.1f} s and {b / 1e9:.1f} s" for a, b in self.changed_ns[:_SPANS_SHOWN]]
            more = len(self.changed_ns) - len(spans)
            others = [f"in {more:,} other places"] if more else []
            where = ", ".join((*spans, *others))
            return SealVerdict.CHANGED, f"changed: what {self.signer} recorded {where} is not what the file has there"
        if self.bad:
            return SealVerdict.CHANGED, f"changed: {own} up to {until_s:.1f} s; behind that is {self.bad}"
        if seal.end and self.rest.hexdigest() != seal.rest_sha256:
            return SealVerdict.CHANGED, f"changed: {own} up to its last message, at {until_s:.1f} s; not what follows"
        if before is not None and self.first.before != (before.first.file if before.first else ""):
            return SealVerdict.CHANGED, f"changed: {own}, but not behind {before.path.name}"
        if not seal.end:
            return (
                SealVerdict.CUT_SHORT,
                f"cut short: {own} up to {until_s:.1f} s ({count}); what follows is not sealed",
            )
        sealed = f"{own}, {count}, sealed to the end"
        if before is None and self.first.before:
            return SealVerdict.AS_RECORDED, f"{sealed}; one part of a longer recording"
        if seal.end == "part" and last:
            return SealVerdict.CUT_SHORT, f"cut short: {sealed}; the next part is missing"
        return SealVerdict.AS_RECORDED, sealed
