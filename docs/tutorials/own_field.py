# %% [markdown]
# # Your own field from a GeoJSON file
#
# Lines are marked, polygons are areas, and the property `is` makes a polygon the boundary or an obstacle. Here the file
# is written first; yours comes from a GIS or a map.

# %%
import json
import tempfile
from pathlib import Path

import touchline

corner = (9.9915, 57.0124)  # longitude, latitude
east, north = 1.0 / 60_760.0, 1.0 / 111_370.0  # degrees per metre there


def at(x_m: float, y_m: float) -> list[float]:
    """Position of a point that lies so far east and north of the corner."""
    return [corner[0] + x_m * east, corner[1] + y_m * north]


def feature(kind: str, coordinates: list, **properties: str) -> dict:
    """Put a feature together."""
    return {"type": "Feature", "properties": properties, "geometry": {"type": kind, "coordinates": coordinates}}


box = [at(0, 0), at(16, 0), at(16, 9), at(0, 9), at(0, 0)]
ground = [at(-3, -3), at(19, -3), at(19, 12), at(-3, 12), at(-3, -3)]
features = [
    feature("LineString", box, name="goal box"),
    feature("LineString", [at(4, 4.5), at(12, 4.5)], name="middle"),
    feature("Polygon", [ground], **{"is": "boundary"}),
]
file = Path(tempfile.mkdtemp()) / "goal-box.geojson"
file.write_text(json.dumps({"type": "FeatureCollection", "features": features}), encoding="utf-8")

# %%
template = touchline.load_template(file)
print(f"{template.length_m:.1f} m of lines, the origin at {template.origin}")

# %%
plan = touchline.plan(template)
run = touchline.simulate(plan, seed=2)
run

# %% tags=["remove-cell"]
assert run.success and abs(template.length_m - 58.0) < 0.2
