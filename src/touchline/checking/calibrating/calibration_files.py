"""Files of a calibrated robot, to be given as `--vehicle` and `--onboard`."""

from __future__ import annotations

from pathlib import Path

from touchline.checking.calibrating.drive_calibration import Calibration
from touchline.recordings.writing import write_text, writing
from touchline.schemas.spec import EVERY_FIELD


def write_files(found: Calibration, folder: Path) -> tuple[Path, ...]:
    """Write the robot's files with the constants that are believed.

    Args:
        found: The calibration.
        folder: Folder to write to, made if it does not exist.

    Returns:
        The files.

    Raises:
        SpecError: They cannot be written.
    """
    with writing(folder, "folder"):
        folder.mkdir(parents=True, exist_ok=True)
    files = {"vehicle.json": found.setup.vehicle, "onboard.json": found.setup.onboard}
    for name, spec in files.items():
        write_text(spec.model_dump_json(indent=1, context=EVERY_FIELD) + "\n", folder / name)
    return tuple(folder / name for name in files)
