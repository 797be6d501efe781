"""Row 8: existence of paths between random pairs of poses, and their mean length."""

from collections.abc import Callable
from functools import partial

from touchline_research.driven_template import CONTESTANTS, OURS, STUDY_CCD, STUDY_KAPPA_1PM, UNPADDED
from touchline_research.pairs import Tally, close_pairs, random_pairs, tally
from touchline_research.pitch import LENGTH_TARGETS, STUDY_SIGMA_1PM2
from touchline_research.table import Row, of_each

CLOSE_SHARE = 0.1
# Number of pairs that the study tried, and that ours must manage.
MUST_PAIRS = 1_000_000
LENGTH_PAIRS_MOST = 1000

Progress = Callable[[str, float], None]


def completeness_row(count: int, progress: Progress) -> Row:
    """Try `count` random pairs with every planner, and a tenth as many less than 0.1 m apart, some coincident."""
    close = max(1, round(CLOSE_SHARE * count))
    apart: list[Tally] = []
    near: list[Tally] = []
    for contestant in CONTESTANTS:
        method = contestant.method(STUDY_KAPPA_1PM, STUDY_SIGMA_1PM2)
        limits = STUDY_KAPPA_1PM, STUDY_SIGMA_1PM2
        step = partial(progress, f"random pairs, {contestant.name}")
        apart.append(tally(method, random_pairs(count), count, *limits, step))
        near.append(tally(method, close_pairs(close), close, *limits))
    return Row(
        "8",
        "complete: random pairs in 10 × 10 m; closer than 0.1 m",
        of_each(
            f"{a.complete:,} of {a.tried:,}; {n.complete:,} of {n.tried:,}" for a, n in zip(apart, near, strict=True)
        ),
        f"all of {MUST_PAIRS:,}, coincident poses included",
        apart[-1].feasible == apart[-1].tried and near[-1].feasible == near[-1].tried,
        {
            "pairs": count,
            "close_pairs": close,
            "study_ccd_complete": apart[1].complete,
            "study_ccd_close_complete": near[1].complete,
            "ours_complete": apart[-1].complete,
            "ours_feasible": apart[-1].feasible,
            "ours_close_feasible": near[-1].feasible,
        },
        "ours counts only paths that end within 1e-9 m and rad of the goal and keep κ_max and σ_max."
        + ("" if count >= MUST_PAIRS else f" Met for {count:,} pairs; `--pairs {MUST_PAIRS}` tries them all."),
    )


def random_length_row(count: int) -> Row:
    """Compare the mean length on random pairs with plain Dubins, at every σ of row 12; for information."""
    count = min(count, LENGTH_PAIRS_MOST)
    limits = STUDY_KAPPA_1PM, STUDY_SIGMA_1PM2
    plain = tally(UNPADDED.method(*limits), random_pairs(count), count, *limits).length_m
    shares = {
        contestant.name: [
            tally(contestant.method(STUDY_KAPPA_1PM, s), random_pairs(count), count, STUDY_KAPPA_1PM, s).length_m
            / plain
            - 1.0
            for s, _ in LENGTH_TARGETS
        ]
        for contestant in (STUDY_CCD, OURS)
    }
    texts = [", ".join(f"{share:+.1%}" for share in values) for values in shares.values()]
    return Row(
        "12, pairs",
        f"length on {count} random pairs, σ_max = " + ", ".join(f"{s:g}" for s, _ in LENGTH_TARGETS),
        (f"{plain / count:.2f} m each, unpadded", texts[0], texts[1]),
        "",
        None,
        {f"{name} σ={s:g}": v for name, vs in shares.items() for (s, _), v in zip(LENGTH_TARGETS, vs, strict=True)},
        "where the paths are short, its full circles cost the study's CCD most.",
    )
