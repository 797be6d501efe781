"""Maps of Nav2 as known ground."""

import math
from io import BytesIO

import numpy as np
import pytest
import shapely
from PIL import Image

from touchline.drawings.occupancy_map import load_map
from touchline.schemas.errors import SpecError

FREE, TAKEN, UNKNOWN = 254, 0, 205
YAML = "image: m.pgm\nresolution: {resolution}\norigin: {origin}\nnegate: {negate}\nmode: {mode}\n"


def write(folder, pixels, *, plain=False, **given):
    rows, columns = pixels.shape
    head = f"{'P2' if plain else 'P5'}\n# made by hand\n{columns} {rows}\n255\n".encode()
    body = " ".join(map(str, pixels.ravel())).encode() if plain else pixels.astype(np.uint8).tobytes()
    (folder / "m.pgm").write_bytes(head + body)
    figures = {"resolution": 0.5, "origin": [0.0, 0.0, 0.0], "negate": 0, "mode": "trinary", **given}
    (folder / "m.yaml").write_text(YAML.format(**figures))
    return folder / "m.yaml"


def taken(ground):
    return shapely.union_all([shapely.Polygon(each.corners, each.holes) for each in ground.obstacles])


@pytest.fixture
def pixels():
    """Four rows of six: one cell taken on the upper left, one unknown on the lower right."""
    shade = np.full((4, 6), FREE)
    shade[0, 0], shade[3, 5] = TAKEN, UNKNOWN
    return shade


def png():
    data = BytesIO()
    Image.fromarray(np.arange(10_000, dtype=np.uint32).reshape(100, 100).view(np.uint8)).save(data, "PNG")
    return data.getvalue()


@pytest.mark.parametrize("mode", ["L", "RGB", "P", "I;16", "bmp"])
def test_images_of_other_formats_say_the_same(tmp_path, pixels, mode):
    expected = taken(load_map(write(tmp_path, pixels)))
    grey = Image.fromarray(pixels.astype(np.uint8))
    if mode == "I;16":
        grey = Image.fromarray(257 * pixels.astype(np.uint16))
    elif mode != "bmp":
        grey = grey.convert(mode)
    grey.save(tmp_path / "m.pgm", "BMP" if mode == "bmp" else "PNG")
    assert taken(load_map(tmp_path / "m.yaml")).equals(expected)


def test_what_is_transparent_is_not_known_to_be_free(tmp_path, pixels):
    expected = taken(load_map(write(tmp_path, pixels)))
    colours = np.full((*pixels.shape, 4), 255, np.uint8)
    colours[pixels != FREE, 3] = 0
    Image.fromarray(colours).save(tmp_path / "m.pgm", "PNG")
    assert taken(load_map(tmp_path / "m.yaml")).equals(expected)


@pytest.mark.parametrize("plain", [False, True])
def test_rows_go_down_and_unknown_is_taken(tmp_path, pixels, plain):
    ground = load_map(write(tmp_path, pixels, plain=plain, origin=[10.0, 20.0, 0.0]))
    expected = shapely.union(shapely.box(10.0, 21.5, 10.5, 22.0), shapely.box(12.5, 20.0, 13.0, 20.5))
    assert taken(ground).symmetric_difference(expected).area < 1e-9
    assert shapely.Polygon(ground.boundary).equals(shapely.box(10.0, 20.0, 13.0, 22.0))


def test_yaw_turns_about_the_lower_left_corner(tmp_path, pixels):
    ground = load_map(write(tmp_path, pixels, origin=[1.0, 2.0, math.pi / 2]))
    expected = shapely.union(shapely.box(-1.0, 2.0, -0.5, 2.5), shapely.box(0.5, 4.5, 1.0, 5.0))
    assert taken(ground).symmetric_difference(expected).area < 1e-9


def test_negate_and_raw(tmp_path, pixels):
    pixels[3, 5] = 128
    negated = taken(load_map(write(tmp_path, 255 - pixels, negate=1)))
    raw = taken(load_map(write(tmp_path, np.where(pixels == FREE, 0, 100), mode="raw")))
    assert negated.symmetric_difference(raw).area < 1e-9


def test_outlines_are_simplified_outward_only(tmp_path):
    rows, columns = np.mgrid[:60, :90]
    cells = rows > 0.37 * columns + 3.0 * np.sin(columns / 9.0) + 10.0
    ground = load_map(write(tmp_path, np.where(cells, TAKEN, FREE), resolution=0.05))
    exact = shapely.union_all([shapely.box(c, 59 - r, c + 1, 60 - r) for r, c in np.argwhere(cells)])
    exact = shapely.affinity.scale(exact, 0.05, 0.05, origin=(0, 0))
    found = taken(ground)
    assert exact.difference(found).area < 1e-9
    assert found.difference(exact.buffer(0.075)).area < 1e-9
    assert sum(len(each.corners) for each in ground.obstacles) < 70 < shapely.get_num_coordinates(exact)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("m.pgm", b"GIF89a"), "no image in PGM, PNG or BMP"),
        (("m.pgm", b"P5\n6 4\n255\nab"), "is damaged"),
        (("m.pgm", b"P5\n6"), "is damaged"),
        (("m.pgm", b"P5\n99999999 99999999\n255\n"), "at most"),
        (("m.pgm", b"P5\n5001 5000\n255\n"), "at most"),
        (("m.pgm", b"P2\n1 1\n255\nx"), "is damaged"),
        (("m.pgm", png()[:300]), "is damaged"),
        (("m.pgm", b"P5\n2 1\n255\n\x00\x00"), "no free cell"),
        (("m.yaml", b"a: [b"), "no YAML"),
        (("m.yaml", b"- 1"), "no map"),
        (("m.yaml", b"image: m.pgm\norigin: [0, 0, 0]\n"), "resolution"),
        (("m.yaml", b"image: n.pgm\nresolution: 1\norigin: [0, 0, 0]\n"), "n.pgm cannot be read"),
        (("m.yaml", b"image: m.pgm\nresolution: 1\norigin: [0, 0, 0]\nfree_thresh: 0.9\n"), "above occupied_thresh"),
        (("m.yaml", b"image: m.pgm\nresolution: 1\norigin: [0, 0]\n"), "origin"),
    ],
)
def test_damaged_maps_are_refused(tmp_path, pixels, change, message):
    path = write(tmp_path, pixels)
    (tmp_path / change[0]).write_bytes(change[1])
    with pytest.raises(SpecError, match=message):
        load_map(path)
