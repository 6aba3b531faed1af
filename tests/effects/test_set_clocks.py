"""Clocks that were set before the aperture, and a receiver's clock between direct path and echo.

Against printed closed forms, whole time series through exact ranges, and images.
"""

import csv
import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bisar_budget.analysis.analysis import Analysis, Case
from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.effects.random_errors import random_errors
from bisar_budget.effects.spectra import PowerLawPiece, heard_parts, set_parts, tone
from bisar_budget.faults import MissionError
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.quantities import number_of, tree_of
from bisar_budget.ranges.exact_ranges import aperture_nodes
from bisar_budget.sampling.probability import monte_carlo
from bisar_budget.simulator.point import simulate_point
from bisar_budget.simulator.realisations import drawn_errors, phase_courses
from bisar_budget.verifier.spread_cases import verify_random
from bisar_budget.verifier.study import Study
from tests.conftest import ROOT, findings, mission_text, row
from tests.effects.test_random_errors import MISSION, OSCILLATORS, agrees_with_draws, of, through_the_clock
from tests.simulate.conftest import only_rotated_images
from tests.verify.test_random_errors import off

F_0 = 9.65e9
# S_φ of a 10 MHz oscillator at the carrier, f⁻⁴ to f⁰ of -95 -90 -200 -130 -155 dB; physics of two equal ones.
YORK = tuple(
    PowerLawPiece(0.0, 1e3, (F_0 / 10e6) ** 2 * 10 ** (level / 10), slope)
    for level, slope in zip((-95, -90, -200, -130, -155), (4.0, 3.0, 2.0, 1.0, 0.0), strict=True)
)
PER_PHASE = SPEED_OF_LIGHT_MPS / (2 * math.pi * F_0)  # m per radian
HOLDOVER = {"method": "holdover", "age": "60 s", "averaging": "10 s"}
LINK = {"interval": "1 s", "error": "1 deg"}
OCXO = {"power_law": {"h-2": "4e-23", "h-1": "2e-24", "h0": "1e-25"}}
STEADY = {"power_law": {"h0": "1e-40"}}  # a clock that hardly drifts
RECEIVER = "platforms__receiver__oscillator"
HELD = MISSION[: MISSION.index("    motion_error")].rstrip()


def one_case(pieces: tuple[PowerLawPiece, ...], T: float, age: float, averaging: float):
    found = set_parts(pieces, *(np.array([one]) for one in (T, age, averaging)))
    return type(found)(*(float(np.ravel(part)[0]) for part in found))


class TestIntegrals:
    @pytest.mark.parametrize(
        ("age", "averaging", "metres", "frequency"), [(60.0, 10.0, 0.88, 8.6e-11), (600.0, 100.0, 27.5, 2.71e-10)]
    )
    def test_two_clocks_of_a_mask(self, age: float, averaging: float, metres: float, frequency: float) -> None:
        """Values of an independent evaluation, printed with two or three digits."""
        found = one_case(YORK, 5.0, age, averaging)
        assert math.sqrt(2 * found.constant) * PER_PHASE == pytest.approx(metres, rel=2e-3)
        slope = math.sqrt(2 * found.linear) * PER_PHASE / 2.5 / SPEED_OF_LIGHT_MPS
        assert slope == pytest.approx(frequency, rel=2e-3)

    @pytest.mark.parametrize(("age", "averaging", "T"), [(60.0, 10.0, 5.0), (8.0, 10.0, 6.0), (1e4, 1.0, 0.1)])
    def test_random_walk_of_frequency(self, age: float, averaging: float, T: float) -> None:
        """σ_y² = 2π²h₋₂·[H − (9/70)(t_c + T)], exact where averaging and aperture do not overlap."""
        h = 4e-23
        found = one_case((PowerLawPiece(0.0, 1e3, F_0**2 * h, 4.0),), T, age, averaging)
        square = found.linear * (PER_PHASE / (T / 2) / SPEED_OF_LIGHT_MPS) ** 2
        assert square == pytest.approx(2 * math.pi**2 * h * (age - 9 / 70 * (averaging + T)), rel=1e-4)

    def test_white_phase_noise_of_disjoint_fits_adds(self) -> None:
        """Density S up to 1 kHz: the mean has S/2T, the slope's edge 3S/2T; the line those of the averaging."""
        T, age, averaging, density = 4.0, 30.0, 10.0, 1e-6
        found = one_case((PowerLawPiece(0.0, 1e3, density, 0.0),), T, age, averaging)
        line = density / 2 / averaging * (1 + 3 * (2 * age / averaging) ** 2)
        assert found.constant == pytest.approx(density / 2 / T + line, rel=2e-3)
        slope = 3 * density / 2 / T + 3 * density / 2 / averaging * (T / averaging) ** 2
        assert found.linear == pytest.approx(slope, rel=2e-3)

    def test_cases_together_are_what_each_is_alone(self) -> None:
        times, ages, averagings = (np.array(one) for one in ((0.5, 5.0, 2.0), (20.0, 600.0, 7.0), (10.0, 100.0, 3.0)))
        together = set_parts(YORK, times, ages, averagings).covariance
        for place, numbers in enumerate(zip(times, ages, averagings, strict=True)):
            alone = one_case(YORK, *map(float, numbers)).covariance
            assert together[..., place] == pytest.approx(alone, rel=1e-9, abs=1e-12)

    def test_an_echo_has_what_a_clock_changes_by_in_its_delay(self) -> None:
        """A dense sum over logarithms of S·4 sin²(πfΔt) times the squares of a tone's parts."""
        pieces = tuple(PowerLawPiece(0.0, 1e3, F_0**2 * h, slope) for slope, h in ((4.0, 2e-20), (2.0, 2e-19)))
        f = np.geomspace(1e-5, 1e3, 2_000_001)
        density = sum(one.density * f**-one.slope for one in pieces) * 4 * np.sin(math.pi * f * 4.1e-3) ** 2
        quadratic, cubic, left, _, linear = tone(math.pi * f * 5.0)
        found = heard_parts(pieces, 5.0, 4.1e-3)
        for part, square in (
            (found.quadratic, quadratic**2),
            (found.cubic, cubic**2),
            (found.left, left),
            (found.linear, linear**2),
        ):
            assert part == pytest.approx(np.trapezoid(density * square, f), rel=1e-3)


def frequency_walks(draws: int, times: np.ndarray, rng: np.random.Generator, h: tuple[float, float]) -> np.ndarray:
    """Time of clocks with random walk (h₋₂) and white (h₀) noise of the frequency, by their steps, (draws, times)."""
    step = times[1] - times[0]
    y = np.cumsum(rng.standard_normal((draws, times.size)) * math.sqrt(2 * math.pi**2 * h[0] * step), axis=1)
    white = rng.standard_normal((draws, times.size)) * math.sqrt(h[1] / 2 / step)
    return np.cumsum(y + white, axis=1) * step


def test_a_set_clock_does_what_whole_time_series_do() -> None:
    """20 000 clocks, set by a line over 4 s, 20 s before mid-aperture; sent through exact ranges."""
    h = (4e-24, 1e-23)
    clock = f"    oscillator: {{power_law: {{h-2: {h[0]}, h0: {h[1]}}}}}\n"
    text = f"{HELD}\n{clock}synchronization: {{method: holdover, age: 20 s, averaging: 4 s}}\n"
    analysis = Analysis(parse_mission(text))
    error, rng = of(analysis, "receiver.oscillator"), np.random.default_rng(21)
    times = np.arange(-22.0, 3.0001, 0.02)
    averaged, flown, nodes = times <= -18.0, times >= -3.0, aperture_nodes(6.0)
    drawn = []
    for _ in range(10):
        time = frequency_walks(2000, times, rng, h)
        line = np.polynomial.polynomial.polyfit(times[averaged], time[:, averaged].T, 1)
        left = time[:, flown] - np.polynomial.polynomial.polyval(times[flown], line)
        smooth = np.polynomial.legendre.legfit(times[flown] / 3, left.T, 3)
        drawn.append(np.polynomial.legendre.legval(nodes / 3, smooth))
    phase = np.concatenate(drawn) * 2 * math.pi * analysis.mission.radar.center_frequency
    agrees_with_draws(error, through_the_clock(analysis.mission, phase))


@pytest.mark.parametrize(
    "sync", ["{method: holdover, age: 20 s, averaging: 4 s}", "{method: direct_path, error: 0 deg}"]
)
def test_what_is_flown_is_what_is_computed(sync: str) -> None:
    """Sums of tones, with a line taken off or heard twice: 4000 know a sigma to 1.1 %; 3 of those."""
    text = f"{HELD}\n    oscillator: {{power_law: {{h-2: 4e-23, h-1: 1e-22, h0: 1e-22}}}}\nsynchronization: {sync}\n"
    mission = parse_mission(text)
    (error,) = [one for one in random_errors(mission) if one.subject.kind == "oscillator"]
    times = np.linspace(-3, 3, 301)
    phases = phase_courses(mission, error, times, 4000, np.random.default_rng(4), 40.0)
    fit = np.polynomial.legendre.legfit(times / 3, phases.T, 3)
    if mission.has_direct_path:
        fit[0] = 0.0  # a constant phase moves nothing
    found = through_the_clock(mission, np.polynomial.legendre.legval(aperture_nodes(6.0) / 3, fit))
    for drawn, computed in zip(found[1:5], (*error.full[3:5], *error.full[:2]), strict=True):
        assert np.std(drawn) == pytest.approx(computed, rel=0.035, abs=1e-9)


class TestSetting:
    def test_section_v_by_10_ns_and_by_1e_11(self) -> None:
        """Exact ranges, printed: 1.67 m and 0.273 m."""
        text = (ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml").read_text(encoding="utf-8")
        link = "{interval: 1 s, error: 0 deg, time_error: 10 ns, frequency_error: 1e-11}"
        analysis = Analysis(parse_mission(f"{text}synchronization: {link}\n"))
        does = {one.id: Case(analysis).does(analysis.full, one) for one in analysis.stated}
        assert math.hypot(*does["timing.time"].displacement) == pytest.approx(1.67, abs=0.005)
        assert math.hypot(*does["timing.frequency"].displacement) == pytest.approx(0.273, abs=0.0005)

    def test_in_holdover_a_frequency_is_a_time_too(self) -> None:
        """y·H of time and y of slope: what timing_error says of both at once."""
        held = findings(synchronization=HOLDOVER | {"frequency_error": "1e-11"}, allocation={"model": "full"})
        stated = Analysis(parse_mission(mission_text(timing_error={"constant": "0.6 ns", "linear": "1e-11"})))
        moved = np.sum([Case(stated).does(stated.full, one).displacement for one in stated.stated], axis=0)
        assert row(held, "timing.frequency").displacement_m == pytest.approx(tuple(moved), rel=1e-4)

    def test_aging_is_a_time_that_grows_with_the_square(self) -> None:
        """1e-10 a day, 60 s after the setting: D·H²/2 = 2.08 ps of time, D·H of frequency."""
        oscillator = OCXO | {"aging": "1e-10 /day"}
        found = findings(
            synchronization=HOLDOVER, platforms__receiver__oscillator=oscillator, allocation={"model": "full"}
        )
        one = row(found, "receiver.oscillator.aging")
        aging = 1e-10 / 86400
        constant, linear = aging * 60**2 / 2, aging * 60
        terms = {"constant": constant, "linear": linear, "quadratic": aging / 2}
        stated = Analysis(parse_mission(mission_text(timing_error=terms)))
        moved = np.sum([Case(stated).does(stated.full, one).displacement for one in stated.stated], axis=0)
        assert one.declared == pytest.approx(aging)
        assert one.displacement_m == pytest.approx(tuple(moved), rel=1e-4)
        assert one.qpe_published_rad == pytest.approx(math.pi * 10e9 * aging / 2 * 6**2 / 2, rel=1e-6)

    def test_a_difference_of_the_channels_delays_counts_with_a_direct_path(self) -> None:
        """10 ns shift the image by 1.5 to 2.6 m; a clock error has no effect there."""
        link = {"method": "direct_path", "error": "1 deg", "time_error": "10 ns", "frequency_error": "1e-9"}
        found = findings(synchronization=link, timing_error={"constant": "10 ns"}, allocation={"model": "full"})
        assert 1.5 < math.hypot(*row(found, "timing.time").displacement_m) < 2.6
        assert row(found, "timing.constant").displacement_m == (0.0, 0.0)
        # 1e-9 of the 36 km by which the echo is longer.
        assert math.hypot(*row(found, "timing.frequency").displacement_m) < 1e-4

    def test_one_without_errors_is_taken_to_be_perfect_and_it_is_said(self) -> None:
        notes = [
            " ".join(map(str, findings(synchronization=HOLDOVER | more).notes)) for more in ({}, {"time_error": 0})
        ]
        assert "no synchronization.time_error and synchronization.frequency_error: the clocks are assumed" in notes[0]
        assert "no synchronization.frequency_error: the clocks" in notes[1]

    def test_declare_asks_for_the_key_that_holdover_has(self) -> None:
        found = findings(synchronization=HOLDOVER, requirements={"declare": ["timing"]})
        assert "synchronization.time_error" in str(row(found, "mission.declare").reason)
        found = findings(synchronization=HOLDOVER | {"time_error": 0}, requirements={"declare": ["timing"]})
        assert row(found, "mission.declare").status == "pass"

    def test_how_good_a_setting_must_be_is_said_where_nothing_is_declared(self) -> None:
        found = findings(
            synchronization=HOLDOVER, requirements={"location_error": "1 m"}, allocation={"model": "full"}
        )
        allowed = row(found, "timing.time")
        assert (allowed.status, allowed.binding_requirement) == ("not_declared", "location_error")
        assert allowed.allowable == pytest.approx(10e-9 / 1.67, rel=5e-3)

    @pytest.mark.parametrize(("scale", "status"), [(0.999, "pass"), (1.001, "fail")])
    def test_both_sides_of_a_limit(self, scale: float, status: str) -> None:
        needs = {"requirements": {"location_error": "1 m"}, "allocation": {"model": "full", "warn_above": "1"}}
        allowed = row(findings(synchronization=HOLDOVER, **needs), "timing.frequency").allowable
        found = findings(synchronization=HOLDOVER | {"frequency_error": scale * allowed}, **needs)
        assert row(found, "timing.frequency").status == status


class TestLocation:
    NEEDS = {"requirements": {"location_error": "10 m"}, "allocation": {"model": "full", "combine": "rss"}}

    def of_age(self, age: str, averaging: str = "10 s", **others):
        return findings(
            platforms__receiver__oscillator=OCXO,
            synchronization={"method": "holdover", "age": age, "averaging": averaging, **others},
            **self.NEEDS,
        )

    def test_free_oscillators_cannot_be_judged_and_the_key_is_named(self) -> None:
        found = findings(platforms__receiver__oscillator=OCXO, **self.NEEDS)
        (location,) = [one for one in found.requirements if one.key == "location_error"]
        assert location.status == "not_evaluated"
        assert "synchronization.method holdover with age and averaging" in str(location.reason)

    def test_an_image_moves_the_more_the_older_the_setting_is(self) -> None:
        moved = [row(self.of_age(age), "mission.location_error").declared for age in ("10 s", "60 s", "600 s")]
        assert moved[0] < moved[1] < moved[2]
        assert row(self.of_age("600 s", "100 s"), "mission.location_error").status == "fail"

    def test_draws_agree(self) -> None:
        clocks = {RECEIVER: OCXO, "platforms__transmitter__oscillator": STEADY}
        text = mission_text(**clocks, synchronization=HOLDOVER, **self.NEEDS)
        analysis = Analysis(parse_mission(text))
        found = monte_carlo(analysis, 20_000, 1)
        (location,) = [one for one in found.requirements if one.id == "mission.location_error"]
        expected = of(analysis, "receiver.oscillator").full.displacement
        assert location.sigma == pytest.approx(expected, rel=0.02)

    def test_it_is_flown_so(self) -> None:
        """From seed to seed an image moves by what is computed, not by hundreds of metres."""
        base = f"{HELD}{OSCILLATORS}synchronization: {{method: holdover, age: 20 s, averaging: 10 s}}\n"
        analysis = Analysis(parse_mission(base))
        sigma = math.hypot(*(one.full.displacement for one in analysis.random if one.subject.kind == "oscillator"))
        missions = [parse_mission(f"{base}simulation: {{seed: {seed}}}\n") for seed in range(1, 9)]
        with only_rotated_images():
            moved = [math.hypot(*simulate_point(mission).effect.displacement) for mission in missions]
        assert max(moved) < 4 * sigma
        assert np.sqrt(np.mean(np.square(moved))) == pytest.approx(sigma, rel=0.6)  # of eight, two and a half sigmas

    def test_verify_confirms_the_limit_and_finds_a_wrong_one(self) -> None:
        needs = "requirements: {quadratic_phase_error: 170 deg, location_error: 1 m}\nallocation: {model: full}\n"
        one = Study(
            parse_mission(
                f"{HELD}{OSCILLATORS}synchronization: {{method: holdover, age: 20 s, averaging: 10 s}}\n{needs}"
            )
        )
        error = of(one.analysis, "receiver.oscillator")
        assert verify_random(one, error).verdict == "confirmed"
        assert verify_random(one, off(error, 0.8)).verdict == "optimistic"

    def test_an_age_is_solved_for_and_swept(self, run: Callable, tmp_path: Path) -> None:
        file, location = tmp_path / "m.yaml", "mission.location_error"
        clocks = {RECEIVER: OCXO, "platforms__transmitter__oscillator": STEADY}
        file.write_text(mission_text(**clocks, synchronization=HOLDOVER, **self.NEEDS))
        done = run("solve", str(file), "--row", location, "--for", "synchronization.age", "--format", "json")
        assert done.exit_code == 0, done.stderr
        age = json.loads(done.stdout)["missions"][0]["value"]
        assert row(self.of_age(f"{age} s"), location).utilization == pytest.approx(1.0, rel=1e-3)
        column = f"{location}.utilization"
        done = run("sweep", str(file), "--vary", "synchronization.age=20,60,600s", "--column", column)
        assert done.exit_code == 0, done.stderr
        for case in csv.DictReader(line for line in done.stdout.splitlines() if line[0] != "#"):
            expected = row(self.of_age(f"{case['synchronization.age [s]']} s"), location).utilization
            assert float(case[column]) == pytest.approx(expected, rel=1e-5)

    def test_a_swept_age_that_reaches_into_the_aperture_is_an_error(self, run: Callable, tmp_path: Path) -> None:
        file = tmp_path / "m.yaml"
        file.write_text(mission_text(platforms__receiver__oscillator=OCXO, synchronization=HOLDOVER, **self.NEEDS))
        swept = run("sweep", str(file), "--vary", "synchronization.age=7.9,8.1s")
        assert "error" in swept.stdout
        assert [",error" in line for line in swept.stdout.splitlines() if line[:1].isdigit()] == [True, False]


class TestDirectPath:
    def test_the_receivers_oscillator_and_its_spurs_count_and_the_transmitters_do_not(self) -> None:
        spurs = {"frequency": "10 MHz", "spurs": {"120 Hz": "-90 dBc"}}
        link = {"method": "direct_path", "error": "0 deg"}
        changes = {f"platforms__{name}__oscillator": OCXO | spurs for name in ("transmitter", "receiver")}
        found = findings(
            synchronization=link, requirements={"islr": "-20 dB", "pslr": "-30 dB"}, **changes,
            allocation={"model": "full"},
        )  # fmt: skip
        assert row(found, "transmitter.oscillator").qpe_full_rad == 0
        assert row(found, "receiver.oscillator").islr_db is not None
        tones = [one for one in found.rows if ".oscillator.spur" in one.id]
        assert [one.id for one in tones] == ["receiver.oscillator.spur.0"]
        geometry = parse_mission(mission_text()).geometry
        places = [geometry.transmitter.position, geometry.receiver.position]
        delay = (sum(math.hypot(*one) for one in places) - math.dist(*places)) / SPEED_OF_LIGHT_MPS
        level = -90 + 20 * math.log10(1000 * 2 * math.sin(math.pi * 120 * delay))
        assert tones[0].declared == pytest.approx(level, abs=0.01)


@pytest.mark.parametrize(
    ("sync", "others", "key", "says"),
    [
        ({"method": "holdover", "averaging": "10 s"}, {}, "synchronization.age", "is missing"),
        ({"method": "holdover", "age": "60 s"}, {}, "synchronization.averaging", "is missing"),
        (HOLDOVER | {"error": "1 deg"}, {}, "synchronization.error", "holdover has no link"),
        (HOLDOVER | {"interval": "1 s"}, {}, "synchronization.interval", "has no part in holdover"),
        ({"interval": "1 s", "error": "1 deg", "age": "60 s"}, {}, "synchronization.age", "has no part in linear"),
        ({"interval": "1 s"}, {}, "synchronization.error", "is missing"),
        (HOLDOVER | {"age": "7.9 s"}, {}, "synchronization.age", "overlaps the aperture of 6 s"),
        (HOLDOVER, {"timing_error": {"constant": "1 ns"}}, "timing_error.constant", "stands beside"),
        (HOLDOVER, {"timing_error": {"linear": "0"}}, "timing_error.linear", "stands beside"),
        (LINK | {"time_error": 0}, {"timing_error": {"constant": 0}}, "timing_error.constant", "would count twice"),
        (LINK | {"frequency_error": 0}, {"timing_error": {"linear": 0}}, "timing_error.linear", "would count twice"),
        (HOLDOVER | {"age": "-1 s"}, {}, "synchronization.age", "must be greater than 0 s"),
        ({}, {RECEIVER: OCXO | {"aging": "1e-10"}}, "platforms.receiver.oscillator.aging", "has no unit"),
        ({}, {RECEIVER: OCXO | {"aging": "-1e-10 /day"}}, "platforms.receiver.oscillator.aging", "at least 0"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_said(sync: dict, others: dict, key: str, says: str) -> None:
    changes = {"synchronization": sync} if sync else {}
    with pytest.raises(MissionError) as caught:
        parse_mission(mission_text(**changes, **others), "m.yaml")
    (fault,) = caught.value.faults
    assert fault.key == key
    assert says in fault.problem
    assert fault.accepted.startswith("accepted: ") or "must be" in fault.problem


def test_an_age_of_half_of_both_is_accepted() -> None:
    mission = parse_mission(mission_text(synchronization=HOLDOVER | {"age": "8 s"}))
    assert number_of(tree_of(mission), "synchronization.age").key == "synchronization.age"


def test_fast_noise_is_flown_with_its_power() -> None:
    """Flat to 5 kHz: joined by straight lines between 4097 moments it lost 1.8 dB."""
    mask = "{1 Hz: -150 dBc/Hz, 5 kHz: -150 dBc/Hz}"
    text = f"{HELD}\n    oscillator: {{frequency: 10 MHz, phase_noise: {mask}}}\n"
    analysis, pulses = Analysis(parse_mission(text)), (np.arange(4000) + 0.5) / 4000 * 6 - 3
    phase = drawn_errors(analysis).clock_course.at(pulses) / PER_PHASE * SPEED_OF_LIGHT_MPS
    fit = np.polynomial.legendre.legfit(pulses / 3, phase, 3)
    left = np.mean(np.square(phase - np.polynomial.legendre.legval(pulses / 3, fit)))
    # 4000 pulses know a power to 2.2 %; eight samples of the fastest tone, joined by straight lines, lose 2 %.
    assert left == pytest.approx(of(analysis, "receiver.oscillator").full.spread ** 2, rel=0.08)
