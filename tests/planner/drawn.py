"""Templates of straight lines, and rectangles to keep in or off."""

from typing import Any

from touchline.schemas.template import LineSpec, Polygon, Template, TemplateSegment

Ends = tuple[float, float, float, float]
"""x₁ y₁ x₂ y₂ (m) of a line."""


def lines(*ends: Ends) -> tuple[TemplateSegment, ...]:
    """Lines s0, s1 and so on."""
    return tuple(
        TemplateSegment(id=f"s{k}", line=LineSpec(start=(a, b), end=(c, d))) for k, (a, b, c, d) in enumerate(ends)
    )


def drawn(*ends: Ends, **others: Any) -> Template:
    """A template of such lines."""
    return Template(name="lines", segments=lines(*ends), **others)


def box(low: tuple[float, float], high: tuple[float, float], name: str = "boundary") -> Polygon:
    (a, b), (c, d) = low, high
    return Polygon(id=name, corners=((a, b), (c, b), (c, d), (a, d)))
