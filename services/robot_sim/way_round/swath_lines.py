"""Swaths of a template's areas as lines: a tool that paints works along them as along any other line."""

from touchline.schemas.line_parts import redrawn
from touchline.schemas.messages import Trajectory
from touchline.schemas.swath_ids import line_id_of
from touchline.schemas.template import Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.paint.targets import nozzle_curve, segment_length_m


def with_swaths_as_lines(template: Template, trajectory: Trajectory, vehicle: Vehicle) -> Template:
    """Return a template whose areas are replaced by their swaths in a plan; unchanged if it has no areas.

    Args:
        template: The template, in the map frame.
        trajectory: Its plan; swaths, or parts of them, that it leaves out are no lines.
        vehicle: Vehicle that paints.
    """
    if not template.areas:
        return template
    swaths = [
        redrawn(
            TemplateSegment.model_construct(id=each.id, label=each.label),
            nozzle_curve(each, 0.0, segment_length_m(each), vehicle),
        )
        for each in trajectory.path.segments
        if template.area_of(each.id) or template.area_of(line_id_of(each.id))
    ]
    return Template.model_validate({**dict(template), "segments": (*template.segments, *swaths), "areas": ()})
