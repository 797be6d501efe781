"""Salt pans: clay basins that a roller makes dense and smooth, all of them and to the very edge."""

import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from touchline.schemas.fields.sheet import Parameters, Point, metres, rectangle
from touchline.schemas.template import Area, Polygon, Template

Length = Annotated[float, Field(ge=15, le=300, description="along x, m")]
Width = Annotated[float, Field(ge=15, le=200, description="along y, m")]

#: Corners of the pond, and where its centre is, as shares of the pan's half length and half width.
POND_CORNERS = 24
POND_AT = (0.25, 0.15)
#: More than a share of the pan would leave a roller no room beside it, m.
BESIDE_M = 7.0

_STUDY = (
    "Coverage of a salt pan by a rear-steered clay roller, planning study (KMUTT, FIBO). The study gives no measures; "
    "93 x 47.6 m is assumed, since its start, x -46.5, y 23.8 m, is then the upper left corner. "
)
_HOW = (
    "Origin at the centre of the {of}, x along the length, y along the width, in m. The boundary is the edge of the "
    "clay: a wall or a dyke, which no part of the machine crosses."
)


class SaltPan(Parameters):
    """The study's pan."""

    length: Length = 93.0
    width: Width = 47.6


class SaltPanL(Parameters):
    """A pan without its upper right corner."""

    length: Length = 93.0
    width: Width = 47.6
    cut_length: Annotated[float, Field(ge=5, le=285, description="of what is missing at the corner, along x, m")] = 40.0
    cut_width: Annotated[float, Field(ge=5, le=185, description="of what is missing at the corner, along y, m")] = 22.0

    @model_validator(mode="after")
    def _keeps_two_arms(self) -> Self:
        for whole, cut in (("length", "cut_length"), ("width", "cut_width")):
            most = getattr(self, whole) - 2 * BESIDE_M
            if getattr(self, cut) > most + 1e-9:
                raise ValueError(
                    f"{cut} must be at most {most:g} m, so that {2 * BESIDE_M:g} m of the {whole} are left"
                )
        return self


class SaltPanPond(Parameters):
    """A pan with a pond in it."""

    length: Length = 93.0
    width: Width = 47.6
    pond: Annotated[float, Field(ge=1, le=100, description="diameter of the pond, m")] = 10.0

    @model_validator(mode="after")
    def _leaves_room_beside_it(self) -> Self:
        sides = zip((self.length, self.width), POND_AT, strict=True)
        most = min((1.0 - off) * side - 2 * BESIDE_M for side, off in sides)
        if self.pond > most + 1e-9:
            raise ValueError(f"the pond must be at most {most:.1f} m wide, so that {BESIDE_M:g} m are left beside it")
        return self


def salt_pan(p: SaltPan) -> Template:
    """The rectangle."""
    title = f"Salt pan, {metres(p.length)} x {metres(p.width)} m"
    return _pan("salt-pan", title, "pan", rectangle(p.length, p.width))


def salt_pan_l(p: SaltPanL) -> Template:
    """An L: the cell of one reflex corner that coverage has to take apart."""
    x, y = p.length / 2, p.width / 2
    across, up = x - p.cut_length, y - p.cut_width
    corners = ((-x, -y), (x, -y), (x, up), (across, up), (across, y), (-x, y))
    cut = f"without {metres(p.cut_length)} x {metres(p.cut_width)} m"
    title = f"Salt pan, L-shaped, {metres(p.length)} x {metres(p.width)} m {cut}"
    return _pan("salt-pan-l", title, "rectangle round the pan", corners)


def salt_pan_pond(p: SaltPanPond) -> Template:
    """The pond is a hole of the area, and an obstacle."""
    x, y = (share * side / 2 for share, side in zip(POND_AT, (p.length, p.width), strict=True))
    angles = [2 * math.pi * k / POND_CORNERS for k in range(POND_CORNERS)]
    pond = tuple((x + p.pond / 2 * math.cos(a), y + p.pond / 2 * math.sin(a)) for a in angles)
    title = f"Salt pan, {metres(p.length)} x {metres(p.width)} m, with a pond of {metres(p.pond)} m"
    return _pan("salt-pan-pond", title, "pan", rectangle(p.length, p.width), pond)


def _pan(name: str, title: str, of: str, corners: tuple[Point, ...], pond: tuple[Point, ...] = ()) -> Template:
    return Template(
        name=name,
        title=title,
        source=_STUDY + _HOW.format(of=of),
        areas=(Area(id="pan", outline=corners, holes=(pond,) if pond else ()),),
        boundary=Polygon(corners=corners),
        obstacles=(Polygon(id="pond", corners=pond),) if pond else (),
    )
