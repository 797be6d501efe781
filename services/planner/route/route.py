"""Route: run-in, painted segments in order with the transitions between them, run-out."""

from touchline.services.planner.route.itinerary import Itinerary
from touchline.services.planner.segments.section import RUN_IN, RUN_OUT, TRANSITION, Section


def route(drive: Itinerary) -> list[Section]:
    """List the sections in driving order; each begins at the pose at which the last one ended."""
    sections = []
    for i, leg in enumerate(drive.legs):
        label = RUN_IN if i == 0 else RUN_OUT if i == len(drive.swaths) else TRANSITION
        sections.append(Section(label, leg.path))
        if i < len(drive.swaths):
            swath = drive.swaths[i]
            for stroke, path in zip(swath.strokes, swath.paths, strict=True):
                sections.append(Section(stroke.label, path, stroke, swath.speed_mps))
    return [section for section in sections if section.path.pieces]
