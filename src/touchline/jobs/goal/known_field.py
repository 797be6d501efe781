"""Field of a drive to a goal: known ground from a template or an occupancy map."""

from pathlib import Path
from typing import Final

from touchline.drawings.occupancy_map import load_map
from touchline.schemas.catalogue import load_template
from touchline.schemas.errors import SpecError
from touchline.schemas.known_ground import OPEN_GROUND, KnownGround

MAP_ENDINGS: Final = (".yaml", ".yml")


def load_ground(field: str | Path) -> KnownGround:
    """Load boundary and obstacles.

    Args:
        field: Name or JSON file of a template, or the YAML file of a Nav2 map.

    Raises:
        SpecError: It cannot be read, or has neither boundary nor obstacles.
    """
    if Path(field).suffix in MAP_ENDINGS:
        return load_map(Path(field))
    ground = KnownGround.of(load_template(field))
    if ground == OPEN_GROUND:
        raise SpecError(str(field), "", "has neither boundary nor obstacles", "give them, or leave the field out")
    return ground
