"""Draw the figures of the README; needs the dev extra.

python docs/make_figures.py
"""

import math
import shutil
from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
import numpy as np

from bisar_budget.evaluators import published_motion
from bisar_budget.mission.load import load_mission
from bisar_budget.mission.model import Mission

HERE = Path(__file__).resolve().parent
MISSION = HERE.parent / "specs" / "missions" / "rigling_moses_section_v.yaml"


COLORS = {"transmitter": "#1f5fa8", "receiver": "#c1502e"}


def plan(panel: plt.Axes, mission: Mission) -> None:
    """Draw the collection from above: platforms, lines of sight, motion, bistatic look and smear direction."""
    geometry = mission.geometry
    for name, state in (("transmitter", geometry.transmitter), ("receiver", geometry.receiver)):
        x, y = state.position[0] / 1e3, state.position[1] / 1e3
        speed = math.hypot(*state.velocity)
        panel.plot([0, x], [0, y], color=COLORS[name], lw=1, ls="--")
        panel.plot(x, y, "o", color=COLORS[name])
        arrow = {"arrowstyle": "-|>", "color": COLORS[name], "lw": 1.6}
        tip = (x + 5 * state.velocity[0] / speed, y + 5 * state.velocity[1] / speed)
        panel.annotate("", tip, (x, y), arrowprops=arrow)
        text = f"{name}\n{state.slant_range / 1e3:.3g} km, {speed:.3g} m/s"
        panel.annotate(text, (x, y), xytext=(8, 4), textcoords="offset points", va="bottom", fontsize=8)
    look = geometry.look_azimuth
    for turn, length, text, style in ((0, 12, "look $\\phi_b$", "-|>"), (-math.pi / 2, 5, "smear (31)", "<|-|>")):
        c, s = length * math.cos(look + turn), length * math.sin(look + turn)
        start = (0, 0) if style == "-|>" else (-c, -s)
        panel.annotate("", (c, s), start, arrowprops={"arrowstyle": style, "color": "black", "lw": 1.4})
        panel.annotate(text, (c, s), xytext=(6, -4), textcoords="offset points", fontsize=8)
    panel.plot(0, 0, "s", color="black", ms=4)
    panel.set(xlabel="east [km]", ylabel="north [km]", xlim=(-7, 42), ylim=(-9, 13), aspect="equal")


def acceleration_limits(panel: plt.Axes, mission: Mission) -> None:
    """Draw the allowable acceleration errors over aperture time, and the declared one far above its line."""
    times = np.geomspace(1, 15, 200)
    share = mission.requirements.quadratic_phase_error / 2
    for name, state in (("transmitter", mission.geometry.transmitter), ("receiver", mission.geometry.receiver)):
        # One call for all aperture times: the evaluators take arrays.
        rows = published_motion(*state.position, *state.velocity, state.slant_range, mission.radar.wavelength, times)
        for (_, _, qpe, _), axis, style in zip(rows[6:], "xyz", ("-", "--", ":"), strict=True):
            if np.any(qpe):  # else there is no limit along this axis
                panel.loglog(times, 1e3 * share / np.abs(qpe), style, color=COLORS[name], label=f"{name} {axis}")
    T = mission.collection.aperture_time
    declared = 1e3 * mission.platforms.transmitter.motion_error.acceleration[0]
    panel.plot(T, declared, "o", color="black", zorder=5)
    panel.annotate(
        f"declared for transmitter x:\n{declared:g} mm/s², 12 times its limit",
        (T, declared), xytext=(0, 34), textcoords="offset points", ha="center", fontsize=8,
        arrowprops={"arrowstyle": "-", "lw": 0.6},
    )  # fmt: skip
    panel.set(
        xlabel="aperture time [s]", ylabel="allowable acceleration error [mm/s²]", xlim=(1, 15), ylim=(0.05, 90)
    )
    panel.set_xticks([1, 2, 4, 6, 10, 15], ["1", "2", "4", "6", "10", "15"])
    panel.set_xticks([], minor=True)
    panel.grid(True, which="both", color="#dddddd", lw=0.5)
    panel.legend(fontsize=8, frameon=False, loc="lower left")


def section_v() -> None:
    """Draw the mission of Section V: where everybody is, and how far the declared error is over its limit."""
    mission = load_mission(str(MISSION))
    plt.rcParams |= {"svg.hashsalt": "bisar-budget", "axes.spines.top": False, "axes.spines.right": False}
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.2, 3.8), layout="constrained", width_ratios=(1.35, 1))
    plan(left, mission)
    acceleration_limits(right, mission)
    figure.savefig(HERE / "section-v.svg", metadata={"Date": None})


def compliance_report() -> None:
    """Photograph the first screen of the compliance report of Section V; needs a Chromium."""
    from datetime import date

    from playwright.sync_api import sync_playwright

    from bisar_budget import __version__
    from bisar_budget.budget.check import check_mission
    from bisar_budget.findings.mission import Report
    from bisar_budget.report import Style, render

    found = check_mission(load_mission(str(MISSION)), date(2026, 11, 21))
    report = Report(version=__version__, missions=(found,))
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1120, "height": 1200}, color_scheme="light")
        page.set_content(render("html", report, Style(root=str(HERE.parent))))
        page.screenshot(path=HERE / "compliance-report.png")
        browser.close()


SCENE = "0, 0; 6 m, -3 m, -6 dB; -5 m, 5 m, -3 dB; clutter -30 dB"
ERROR_ALONG_TRACK = (1.0, 5.0, 2.0)  # m, of the transmitter's position, for the picture of a displaced response
# What docs/section-v-figures.md shows: name of the file, panel of `point_plot`, which images.
PICTURES = (
    ("fig3", "fig3", "paper"),
    ("fig4", "fig4", "paper"),
    ("fig5", "fig5", "paper"),
    ("fig6", "fig6", "paper"),
    ("fig7", "fig7", "paper"),
    ("fig7-back", "fig7_back", "paper"),
    ("cuts", "cuts", "paper"),
    ("displaced", "fig5", "displaced"),
    ("scene-before", "fig5", "scene"),
    ("scene-after", "fig7_back", "scene"),
)


def gallery() -> None:
    """Draw Figures 3 to 7 of the paper, one picture each, a displaced response, and a scene."""
    from bisar_budget.report.drawing import point_plot
    from bisar_budget.report.drawing.point_plot import sheet
    from bisar_budget.simulator.point import simulate_point
    from bisar_budget.simulator.targets import parse_targets

    mission = load_mission(str(MISSION))
    platforms = mission.platforms
    error = platforms.transmitter.motion_error._replace(position=ERROR_ALONG_TRACK)
    transmitter = platforms.transmitter._replace(motion_error=error)
    displaced = mission._replace(platforms=platforms._replace(transmitter=transmitter))
    paper = simulate_point(mission, image_former="polar_format")
    (HERE / "section-v-images.png").write_bytes(point_plot.drawn(paper, mission.name, "png", is_paper=True))
    sheets = {
        "paper": sheet(paper, is_paper=True),
        "displaced": sheet(simulate_point(displaced)),
        "scene": sheet(simulate_point(mission, targets=parse_targets(SCENE))),
    }
    folder = HERE / "section-v-figures"
    folder.mkdir(exist_ok=True)
    for name, panel, images in PICTURES:
        (folder / f"{name}.png").write_bytes(point_plot.drawn_panel(panel, sheets[images]))


if __name__ == "__main__":
    section_v()
    gallery()
    compliance_report()
