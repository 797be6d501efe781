"""The tennis court."""

from typing import Annotated

from pydantic import Field

from touchline.schemas.fields.sheet import Parameters, Sheet
from touchline.schemas.template import Template

LENGTH_M, DOUBLES_M, SINGLES_M, SERVICE_M = 23.77, 10.97, 8.23, 6.40
#: The centre service line and the centre mark must be 5 cm, and the other lines may be: one nozzle for all.
LINE_M, CENTRE_MARK_M = 0.05, 0.10


class Tennis(Parameters):
    """Rule 1: fixed dimensions; only the baselines may be wider."""

    baseline_width: Annotated[float, Field(ge=0.05, le=0.10, description="baselines, m")] = LINE_M
    doubles: Annotated[bool, Field(description="the doubles court round the singles court")] = True


def tennis(p: Tennis) -> Template:
    """A court for singles and, by default, doubles."""
    sheet = Sheet(LINE_M)
    half, end = sheet.half, LENGTH_M / 2
    outer, inner = (DOUBLES_M if p.doubles else SINGLES_M) / 2 - half, SINGLES_M / 2 - half
    service = SERVICE_M - half
    sheet.line("centre-service-line", "Centre service line", (-service, 0.0), (service, 0.0))
    sheet.line("service-line-east", "Service line (east)", (service, inner), (service, -inner))
    sheet.line("service-line-west", "Service line (west)", (-service, -inner), (-service, inner))
    for side, sign in (("west", -1), ("east", 1)):
        inside = sign * (end - p.baseline_width)
        tip = inside - sign * CENTRE_MARK_M
        sheet.line(f"centre-mark-{side}", f"Centre mark ({side})", (inside, 0.0), (tip, 0.0))
    if p.doubles:
        reach = end - half
        sheet.line("singles-sideline-north", "Singles sideline (north)", (-reach, inner), (reach, inner))
        sheet.line("singles-sideline-south", "Singles sideline (south)", (reach, -inner), (-reach, -inner))
    name = "Doubles sideline" if p.doubles else "Singles sideline"
    key = "doubles-sideline" if p.doubles else "singles-sideline"
    middle = end - p.baseline_width / 2
    sheet.band("baseline-east", "Baseline (east)", (middle, outer), (middle, -outer), p.baseline_width)
    sheet.line(f"{key}-south", f"{name} (south)", (end, -outer), (-end, -outer))
    sheet.band("baseline-west", "Baseline (west)", (-middle, -outer), (-middle, outer), p.baseline_width)
    sheet.line(f"{key}-north", f"{name} (north)", (-end, outer), (end, outer))
    source = (
        "ITF Rules of Tennis 2024, Rule 1 (The Court). Origin at the centre of the court, x along the sidelines, "
        "y north, in m. Dimensions are to the outside of the lines (service lines from the net: 6.40 m), so "
        "strokes run half a line width inside them. All lines are 5 cm, which Rule 1 prescribes for the centre "
        "service line and the centre marks and allows for all; a wider baseline is painted in two strokes. The "
        "centre marks reach 10 cm into the court from the inside of the baseline."
    )
    return sheet.template("tennis", f"Tennis, {'doubles and singles' if p.doubles else 'singles'}", source)
