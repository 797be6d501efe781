"""Pictures of the study of obstacles: contacts over speed by each rule."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from touchline.services.planner.plots.style import plan_style, save
from touchline_research.obstacles.protected_lines import RULES, LineRuns

DPI = 100
OURS_COLOUR, OTHER_COLOURS = ("#1769aa", "#7fb2d9"), ("#d9480f", "#e8a33d", "#8a5a2b", "#5f8f4e", "#7b4fa0")
COLOURS: Final = dict(zip((rule.name for rule in RULES), (*OURS_COLOUR, *OTHER_COLOURS), strict=True))


def save_obstacle_pictures(lines: Sequence[LineRuns], folder: Path) -> list[Path]:
    """Write all pictures to `folder`; returns the files.

    Raises:
        OSError: A file cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    contacts = folder / "obstacles-contacts.png"
    with plan_style():
        plot_contacts(lines, contacts)
    return [contacts]


def plot_contacts(lines: Sequence[LineRuns], path: Path) -> None:
    """Plot contacts in motion over mean speed by each rule, a panel for each crowd."""
    from matplotlib.figure import Figure

    crowds = list(dict.fromkeys(each.people.name for each in lines))
    figure = Figure(figsize=(10.0, 4.4), layout="constrained")
    panels = figure.subplots(1, len(crowds), sharex=True, sharey=True, squeeze=False)[0]
    for axes, crowd in zip(panels, crowds, strict=True):
        for each in lines:
            if each.people.name == crowd:
                point = each.mean_mps, each.moving / each.hours
                axes.plot(*point, "o", color=COLOURS[each.rule.name], markersize=9, label=each.rule.name, clip_on=False)
        axes.set_yscale("symlog", linthresh=1.0)
        axes.set(title=crowd, xlabel="mean speed (m/s)", xlim=(0.0, 1.45), ylim=(0.0, 2000.0))
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(color="#e3e6e4", linewidth=0.7)
        axes.set_axisbelow(True)
    panels[0].set_ylabel("contacts in motion per hour")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    save(figure, path, DPI)
