"""Files of a scenario that errs as a log does, to be given as `--scenario` and `--onboard`."""

from __future__ import annotations

from pathlib import Path

from touchline.checking.reality.scenario_fit import ScenarioFit
from touchline.recordings.writing import write_text, writing
from touchline.schemas.spec import EVERY_FIELD


def write_fit(fit: ScenarioFit, folder: Path) -> tuple[Path, ...]:
    """Write scenario and computer's configuration.

    Args:
        fit: The fit.
        folder: Folder to write to, made if it does not exist.

    Returns:
        The files.

    Raises:
        SpecError: They cannot be written.
    """
    with writing(folder, "folder"):
        folder.mkdir(parents=True, exist_ok=True)
    files = {"scenario.json": fit.scenario, "onboard.json": fit.onboard}
    for name, spec in files.items():
        write_text(spec.model_dump_json(indent=1, context=EVERY_FIELD) + "\n", folder / name)
    return tuple(folder / name for name in files)
