"""Note of the active recording in the run folder, from which a restarted bridge resumes after a kill."""

import hashlib
import json
import os
import re
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

from touchline.bus import BusConfig
from touchline.recordings.part_limits import UNLIMITED, PartLimits
from touchline.schemas.errors import TouchlineError
from touchline.supervision.private_folder import open_private, run_folder

#: A bridge without a supervisor continues a recording written to this recently: an older one is another session.
_RECENT_S = 60.0
_LARGEST_NOTE_BYTES = 1024 * 1024


class ActiveRecording:
    """Note of the active recording. If it cannot be written, a killed bridge does not resume.

    Args:
        config: The bus; there is one bridge on it.
        folder: The recordings folder.
        supervisor: Process id of the supervisor that restarts the bridge, if any.
    """

    def __init__(self, config: BusConfig, folder: Path, supervisor: int | None) -> None:
        robots = ",".join(config.namespaces)
        if len(config.namespaces) > 1:  # all their names may be too long for a file's
            robots = hashlib.blake2b(robots.encode(), digest_size=8).hexdigest()
        self._name = re.sub(r"\W+", "-", f"{config.endpoint}-{robots}") + ".recording"
        self._folder = folder
        self._supervisor = supervisor

    def note(self, parts: Sequence[Path], limits: PartLimits) -> None:
        """Note the recording's files so far, of which the last one is being written, and the limits of a part."""
        found = {"supervisor": self._supervisor, "parts": [str(part) for part in parts], "limits": asdict(limits)}
        self._write(json.dumps(found))

    def forget(self) -> None:
        """Delete the note: nothing is being recorded."""
        with suppress(TouchlineError, OSError):
            (run_folder() / self._name).unlink(missing_ok=True)

    def left_behind(self) -> tuple[list[Path], PartLimits]:
        """Return files and limits of the recording active when the previous bridge was killed; no files if none was."""
        nothing: tuple[list[Path], PartLimits] = [], UNLIMITED
        try:
            with os.fdopen(open_private(run_folder() / self._name, os.O_RDWR), encoding="utf-8") as file:
                found = json.loads(file.read(_LARGEST_NOTE_BYTES) or "{}")
            parts = [Path(part) for part in found.get("parts", ())]
            ours = bool(parts) and found.get("supervisor") == self._supervisor
            if not ours or any(not part.is_relative_to(self._folder) for part in parts):
                return nothing
            limits = PartLimits(**found.get("limits", {}))
            age_s = time.time() - parts[-1].stat().st_mtime
        except (TouchlineError, OSError, ValueError, TypeError, AttributeError):
            return nothing
        return (parts, limits) if self._supervisor is not None or age_s < _RECENT_S else nothing

    def _write(self, text: str) -> None:
        with suppress(TouchlineError, OSError):
            path = run_folder() / self._name
            part = path.with_suffix(".part")
            with os.fdopen(open_private(part, os.O_WRONLY | os.O_TRUNC), "w", encoding="utf-8") as file:
                file.write(text)
            part.replace(path)
