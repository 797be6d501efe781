"""Folder of recordings: how they are made there, and the restriction of requested ones to it."""

import unicodedata
from collections.abc import Sequence
from pathlib import Path

from touchline.recordings.recorder import Existing, Recorder
from touchline.recordings.recording_file import RecordingError
from touchline.recordings.sealing import Signer
from touchline.schemas import topics
from touchline.schemas.plain_text import plain

#: Longest file name, bytes, with room for the number that an older recording of that name gets.
MOST_NAME_BYTES = 200
_MOST_PATH_CHARACTERS = 4000


class RecordingFolder:
    """Folder of recordings requested over the bus.

    Args:
        path: The folder; symbolic links in it are followed once, now.
        existing: What to do when a recording's file exists.
        signer: Identity that seals the recordings, if any.

    Raises:
        RecordingError: There is no such folder.
    """

    def __init__(self, path: Path, existing: Existing = Existing.RENAME, signer: Signer | None = None) -> None:
        self._existing = existing
        self._signer = signer
        try:
            self.path = path.resolve(strict=True)
        except (OSError, RuntimeError, ValueError) as error:
            raise RecordingError(f"{path}: there is no such folder to record to") from error
        if not self.path.is_dir():
            raise RecordingError(f"{path}: is no folder to record to")

    def place(self, asked: str) -> Path:
        """Return the path of a requested recording, given relative to the folder, or absolute in it.

        Raises:
            RecordingError: It is outside of the folder, its folder does not exist, or its name cannot be a file's.
        """
        shown = plain(asked, 300)
        if not asked or any(unicodedata.category(character) in ("Cc", "Cs") for character in asked):
            raise RecordingError(f"{shown or 'an empty name'}: a recording's path has no control characters")
        path = self.path / asked
        if len(asked) > _MOST_PATH_CHARACTERS or len(path.name.encode()) > MOST_NAME_BYTES:
            raise RecordingError(f"{shown}: a recording's name has at most {MOST_NAME_BYTES} bytes")
        try:
            folder = path.parent.resolve(strict=True)
        except (OSError, RuntimeError) as error:  # RuntimeError: links that go in a circle
            raise RecordingError(f"{shown}: its folder does not exist") from error
        if not folder.is_relative_to(self.path) or path.name in ("", ".."):
            raise RecordingError(
                f"{shown}: is outside of the recordings folder {self.path}; give a path in it, or choose another "
                "with --recordings where the system is started"
            )
        return folder / path.name

    def recorder(self, path: Path, namespaces: Sequence[str], continues: Sequence[Path]) -> Recorder:
        """Create a recording, in this folder or, if the command line names it, another.

        Args:
            path: Its file.
            namespaces: Namespaces of the robots.
            continues: The files of the same recording before this one.

        Raises:
            RecordingError: The file cannot be created.
        """
        return Recorder(path, namespaces, topics.RECORDED, self._existing, continues, signer=self._signer)
