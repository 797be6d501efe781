"""Restriction of recordings requested over the bus to one folder."""

import unicodedata
from pathlib import Path

from touchline.recordings.recording_file import RecordingError
from touchline.schemas.plain_text import plain

#: Longest file name, bytes, with room for the number that an older recording of that name gets.
MOST_NAME_BYTES = 200
_MOST_PATH_CHARACTERS = 4000


class RecordingFolder:
    """Folder of recordings requested over the bus.

    Args:
        path: The folder; symbolic links in it are followed once, now.

    Raises:
        RecordingError: There is no such folder.
    """

    def __init__(self, path: Path) -> None:
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
