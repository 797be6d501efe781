"""Unbuffered output file of a recording; a failed write leaves no broken record."""

import os
from pathlib import Path

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import DataEnd, Footer
from mcap.writer import MCAP0_MAGIC

from touchline.schemas.errors import TouchlineError

_CREATE = os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC


class RecordingError(TouchlineError):
    """Recording that cannot be written, or cannot be read at all."""


class RecordingFile:
    """An unbuffered file for ``mcap.writer.Writer``, which hands over whole records only.

    Unbuffered, so that whatever was written survives the process (kill -9); not synchronised to the disk, so a power
    cut may take the last seconds.

    Args:
        path: File to create; it must not exist.

    Raises:
        RecordingError: It exists or cannot be created.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._descriptor = os.open(path, _CREATE, 0o644)
        except (OSError, ValueError) as error:  # ValueError: a path with a null byte
            reason = error.strerror if isinstance(error, OSError) else error
            raise RecordingError(f"{path}: cannot create the recording: {reason}") from error
        self._size = 0
        self._records_end = 0
        self._open = True

    def tell(self) -> int:
        """Return the number of bytes written."""
        return self._size

    def flush(self) -> None:
        """Do nothing: nothing is buffered."""

    def write(self, data: bytes) -> int:
        """Append whole records.

        Raises:
            RecordingError: The disk is full or failed. The file then ends with the last whole record.
        """
        if not data:
            return 0
        view = memoryview(data)
        try:
            while view:
                view = view[os.write(self._descriptor, view) :]
        except OSError as error:
            os.ftruncate(self._descriptor, self._size)
            os.lseek(self._descriptor, self._size, os.SEEK_SET)
            raise RecordingError(f"{self.path}: cannot write: {error.strerror}") from error
        if self._records_end == self._size and data[0] != Opcode.DATA_END:
            self._records_end += len(data)
        self._size += len(data)
        return len(data)

    def close(self) -> None:
        """Close the file; harmless when repeated."""
        if self._open:
            self._open = False
            os.close(self._descriptor)

    def close_short(self) -> bool:
        """End the file, after a failed write, as a valid MCAP without a summary; it takes 46 bytes.

        Returns:
            Whether there was room for the ending. Without it the file can still be read up to its last record.
        """
        ending = RecordBuilder()
        DataEnd(data_section_crc=0).write(ending)
        Footer(summary_start=0, summary_offset_start=0, summary_crc=0).write(ending)
        ending.write(MCAP0_MAGIC)
        try:
            os.ftruncate(self._descriptor, self._records_end)
            os.lseek(self._descriptor, self._records_end, os.SEEK_SET)
            self._size = self._records_end
            self.write(bytes(ending.end()))  # type: ignore[no-untyped-call]
        except (OSError, RecordingError):
            return False
        else:
            return True
        finally:
            self.close()
