"""Changes that change a hash, and changes that do not."""

import json
import math
import random
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from touchline.schemas import topics
from touchline.schemas.catalogue import load_template
from touchline.schemas.digest import SessionDigest, scenario_hash
from touchline.schemas.faults import fault_models
from touchline.schemas.messages import PlanOptions
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import GnssNoise, Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle

SQUARE = load_template("study-square")
HASHED = [topic for topic in topics.RECORDED if topic.hashed]
SAID = st.lists(st.tuples(st.sampled_from(HASHED), st.binary(max_size=40)), max_size=300)


def digest(said):
    session = SessionDigest()
    session.add(said)
    return session.hexdigest()


@given(SAID, st.randoms(use_true_random=False))
def test_how_topics_interleave_does_not_matter(said, rng: random.Random):
    queues = {topic.name: [pair for pair in said if pair[0] is topic] for topic in HASHED}
    mixed = []
    while any(queues.values()):
        mixed.append(queues[rng.choice(sorted(name for name, queue in queues.items() if queue))].pop(0))
    assert digest(mixed) == digest(said)


@given(SAID.filter(lambda said: any(payload for _, payload in said)), st.data())
def test_every_bit_counts(said, data):
    index = data.draw(st.sampled_from([i for i, (_, payload) in enumerate(said) if payload]))
    topic, payload = said[index]
    bit = data.draw(st.integers(0, 8 * len(payload) - 1))
    other = bytearray(payload)
    other[bit // 8] ^= 1 << bit % 8
    assert digest([*said[:index], (topic, bytes(other)), *said[index + 1 :]]) != digest(said)


@given(SAID, st.data())
def test_every_message_its_place_and_its_topic_count(said, data):
    index = data.draw(st.integers(0, len(said)))
    topic, other = data.draw(st.permutations(HASHED))[:2]
    more = [*said[:index], (topic, b"more"), *said[index:]]
    elsewhere = [*said[:index], (other, b"more"), *said[index:]]
    last = [*said, (topic, b"more")]
    assert len({digest(said), digest(more), digest(elsewhere)}) == 3
    comes_later = [pair for pair in said[index:] if pair[0] is topic]
    assert (digest(last) == digest(more)) == all(pair[1] == b"more" for pair in comes_later)


def test_what_has_caused_a_session_does_not_count():
    said = [(topics.IMU, b"said"), (topics.ORDERS, b"start")]
    assert digest(said) == digest(said[:1])


def test_looking_in_between_changes_nothing():
    looked, plain = SessionDigest(), SessionDigest()
    for number in range(200):
        said = [(topics.IMU, bytes([number])), (topics.DIAGNOSTICS, b"wall clock")]
        looked.add(said)
        plain.add(said[:1])
        looked.hexdigest()
    assert looked.hexdigest() == plain.hexdigest()


def test_topics_that_few_sessions_have_count_only_there(monkeypatch):
    plain, with_area = digest([(topics.IMU, b"x")]), digest([(topics.IMU, b"x"), (topics.AREA, b"")])
    assert plain != with_area
    general = [topic for topic in HASHED if topic.general]
    assert len(general) == len(HASHED) - 19
    monkeypatch.setattr("touchline.schemas.digest.RECORDED", general)
    assert digest([(topics.IMU, b"x")]) == plain


def test_where_one_payload_ends_counts():
    assert digest([(topics.EVENTS, b"ab"), (topics.EVENTS, b"c")]) != digest(
        [(topics.EVENTS, b"a"), (topics.EVENTS, b"bc")]
    )


def cause(scenario=None, template=SQUARE, options=None, **robot):
    return scenario_hash(Setup(scenario=scenario or Scenario(), **robot), template, options or PlanOptions())


def test_the_scenario_hash_is_of_causes_not_of_names():
    assert cause(Scenario(name="other")) == cause()
    others = [
        cause(Scenario(seed=2)),
        cause(Scenario(noise="none")),
        cause(Scenario(noise="none", gnss=GnssNoise(white_m=0.01))),
        cause(onboard=OnboardConfig(follower="pure-pursuit")),
        cause(onboard=OnboardConfig(gnss={"white_m": 0.01})),
        cause(vehicle=Vehicle(tool={"nozzle_y_m": -0.4})),
        cause(template=load_template("soccer-11")),
        cause(options=PlanOptions(paint_speed_mps=0.9)),
        cause(options=PlanOptions(method="dubins-padded")),
    ]
    assert len({cause(), *others}) == len(others) + 1


def leaves(value, path=()):
    """(path, value) of every number and text within."""
    if isinstance(value, dict):
        children = value.items()
    elif isinstance(value, list):
        children = enumerate(value)
    else:
        yield path, value
        return
    for key, child in children:
        yield from leaves(child, (*path, key))


def changed(dump, path, value):
    copy = json.loads(json.dumps(dump))
    inner = copy
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    return copy


CHOICES = {  # one of its kind, where a text or a number cannot be any
    "follower": "external",
    "noise": "none",
    "rate_hz": 5,
    "surface": "wet-grass",
    "best_fix": "none",
    "fix": "single",
    "sensor": "magnetometer",
    "actuation": "SPRAY",
}
NOT_TO_BE_CHANGED = ("kind",)  # of a fault, a drive or a tool: another kind has other fields


def another(name, value):
    """The least that a field can be changed by."""
    if name == "position":
        return {"open": "closed", "up": "down"}[value]
    if name in CHOICES:
        return CHOICES[name]
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return value + 1
    if isinstance(value, float):
        return math.nextafter(value, 0.0 if value > 0.0 else 1.0)
    return f"{value}x"


def fault_of(model):
    """One with all of its fields given."""
    kind = get_args(model.model_fields["kind"].annotation)[0]
    figures = {"sensor": "imu", "delay_s": 0.1, "claimed_m": 0.1, "position": "up" if kind == "disc-stuck" else "open"}
    given = {name: value for name, value in figures.items() if name in model.model_fields}
    return {"kind": kind, "start_s": 1.0, "duration_s": 2.0, **given}


RICH = Scenario(
    start={"x_m": 1.0, "y_m": 2.0, "heading_rad": 3.0},
    sky=[{"name": "oaks", "outline": [[0, 0], [1, 0], [0, 1]]}],
    steel=[{"name": "post", "outline": [[0, 0]]}],
    faults=[fault_of(model) for model in fault_models().values()],
)
BOUNDED = Template(
    name="two",
    segments=[
        {"id": "a", "line": {"start": (0.0, 0.0), "end": (5.0, 0.0)}},
        {"id": "b", "arc": {"start": (5.0, 0.0), "center": (5.0, 2.0), "sweep_angle": 1.0}},
    ],
    areas=[
        {
            "id": "lawn",
            "outline": [(0.0, 3.0), (4.0, 3.0), (4.0, 6.0)],
            "holes": [[(3.0, 3.5), (3.5, 3.5), (3.5, 4.0)]],
            "angle_deg": 20.0,
        }
    ],
    boundary={"corners": [(-9.0, -9.0), (9.0, -9.0), (0.0, 9.0)]},
    origin={"latitude_deg": 57.0, "longitude_deg": 10.0},
)
ENDS = PlanOptions(start=[1.0, 2.0, 3.0], end=[4.0, 5.0, 6.0])


@pytest.mark.parametrize(
    ("what", "subject", "uncounted"),
    [
        ("scenario", RICH, {("name",)}),
        ("vehicle", Vehicle(), set()),
        ("template", BOUNDED, set()),
        ("options", ENDS, {("area_method",), ("obstructed",)}),
    ],
    ids=["scenario", "vehicle", "template", "options"],
)
def test_every_field_is_a_cause_by_the_least_of_changes(what, subject, uncounted):
    dump = subject.model_dump(mode="json")
    found, plain = {}, cause(**{what: subject})
    for path, value in leaves(dump):
        if value is None or path[-1] in NOT_TO_BE_CHANGED:
            continue
        other = type(subject).model_validate(changed(dump, path, another(path[-1], value)))
        found[path] = cause(**{what: other})
    assert {path for path, digest in found.items() if digest == plain} == uncounted
    counted = [digest for path, digest in found.items() if path not in uncounted]
    assert len(set(counted)) == len(counted)


def test_how_areas_are_covered_is_a_cause_where_there_are_any():
    assert cause(template=BOUNDED, options=PlanOptions(area_method="other")) != cause(template=BOUNDED)
    assert cause(options=PlanOptions(area_method="other")) == cause()


def test_what_is_left_to_a_default_counts_as_well_as_what_is_given():
    assert cause(Scenario(start={"x_m": 0.0, "y_m": 0.0, "heading_rad": 0.0})) != cause()
    lasting, passing = ({"kind": "bumper", "start_s": 1.0, "duration_s": length} for length in (None, 1.0))
    assert cause(Scenario(faults=[lasting])) != cause(Scenario(faults=[passing]))
    assert cause(Scenario(faults=[lasting, passing])) != cause(Scenario(faults=[passing, lasting]))
    assert cause(template=BOUNDED) != cause(template=BOUNDED.model_copy(update={"boundary": None}))
    assert cause(template=BOUNDED) != cause(template=BOUNDED.model_copy(update={"origin": None}))
    assert cause(Scenario(seed=1, gnss=GnssNoise())) == cause()
