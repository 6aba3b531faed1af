"""Defects put into the code on purpose, and the tests that must fail for each: `docs/prove_mutants.py` runs them.

A mutant is a slip that the code could have: a sign, a factor, a bracket, a tolerance. The tests named for it compare
the code with geometry, images or rules of the contract, so that each fails for a reason of physics. A comparison with
the committed output of a command is not named here.
"""

import json
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent


class Mutant(NamedTuple):
    """A slip: in the file at `path`, `before` stands once and becomes `after`; `tests` are pytest's node ids."""

    name: str
    path: str
    before: str
    after: str
    tests: tuple[str, ...]

    def of(self, text: str) -> str:
        """Text of the file with the slip.

        Raises
        ------
        ValueError
            What it replaces does not stand there exactly once: the code has changed, and the mutant must follow.
        """
        if text.count(self.before) != 1:
            raise ValueError(f"{self.name}: {self.path} has {text.count(self.before)} times {self.before!r}")
        return text.replace(self.before, self.after)


_DERIVED = "bisar_budget/theory/differential_range.py"
_TABLES = "bisar_budget/theory/published.py"
_EVALUATORS = "bisar_budget/evaluators.py"
_GEOMETRY = "bisar_budget/geometry.py"
_KINDS = "bisar_budget/error_kinds/kind.py"
_POINT = "bisar_budget/simulator/point.py"
_PIECES = "bisar_budget/effects/effect.py"
_PHASES = "bisar_budget/verifier/phase_cases.py"
_NOISE = "bisar_budget/verifier/spread_cases.py"

_PLOT = "bisar_budget/report/drawing/point_plot.py"

_FIGURES_3_TO_7 = "tests/simulate/test_figures.py::"
_BORDERS = "tests/verify/test_verdict_borders.py::"
_IMAGES = "tests/simulate/test_point_against_images.py::"
_POINTS_OF_29 = f"{_IMAGES}test_points_of_29_are_where_each_third_of_the_aperture_puts_the_response"
_SMEAR_DIRECTION = "tests/theory/test_smear_direction.py::test_a_range_rate_moves_the_image_along_31"
_SMEAR_OF_A_VERDICT = f"{_BORDERS}test_the_smear_of_a_verdict_lies_along_31"
_FIVE_PERCENT = f"{_BORDERS}test_a_velocity_limit_is_confirmed_within_5_percent_of_the_budget"
_SEAMS = "tests/acceptance/test_seams.py::"
_LINE_OF_SIGHT = "tests/house/test_geometry.py::test_a_line_of_sight_turns_as_the_platform_flies"

# Drawn by chance over the lines of the package: an operator, a number, a comparison, a word.
SAMPLED = tuple(
    Mutant(one["name"], one["path"], one["before"], one["after"], (one["test"],))
    for one in json.loads(Path(__file__).with_name("sampled_mutants.json").read_text(encoding="utf-8"))
)

MUTANTS = (
    *SAMPLED,
    Mutant(
        "(31): sign",
        _DERIVED,
        "in_angles(adjugate[:, 1])",
        "in_angles(-adjugate[:, 1])",
        (_SMEAR_DIRECTION,),
    ),
    Mutant(
        "(31): turned by 90°",
        _DERIVED,
        "in_angles(adjugate[:, 1])",
        "in_angles(Matrix([adjugate[1, 1], -adjugate[0, 1]]))",
        (_SMEAR_DIRECTION,),
    ),
    Mutant(
        "(31): the first column of Q⁻¹",
        _DERIVED,
        "in_angles(adjugate[:, 1])",
        "in_angles(adjugate[:, 0])",
        (_SMEAR_DIRECTION,),
    ),
    Mutant(
        "(31) of a verdict: turned by 90°",
        _PHASES,
        "(study.geometry.look_azimuth + math.pi / 2) % math.pi",
        "study.geometry.look_azimuth % math.pi",
        (_SMEAR_OF_A_VERDICT,),
    ),
    Mutant(
        "(31) of a verdict: mirrored",
        _PHASES,
        "(study.geometry.look_azimuth + math.pi / 2) % math.pi",
        "(-study.geometry.look_azimuth + math.pi / 2) % math.pi",
        (_SMEAR_OF_A_VERDICT,),
    ),
    Mutant(
        "share of the clock: the transmitter's",
        "bisar_budget/mission/model.py",
        "return self.receiver if self.clock is None else self.clock",
        "return self.transmitter if self.clock is None else self.clock",
        ("tests/budget/test_check.py::TestAllocation::test_without_a_share_the_clock_is_held_to_the_receivers",),
    ),
    Mutant(
        "turn of a line of sight: sign of the climb in its radial part",
        _GEOMETRY,
        "        radial = dot(u, v)\n",
        "        radial = dot(u, (v[0], v[1], -v[2]))\n",
        (_LINE_OF_SIGHT,),
    ),
    Mutant(
        "turn of a line of sight: sign of the climb in its vertical part",
        _GEOMETRY,
        "            (v[2] - u[2] * radial) / R,\n",
        "            (-v[2] - u[2] * radial) / R,\n",
        (_LINE_OF_SIGHT,),
    ),
    Mutant(
        "cross-range resolution: without its sine",
        _GEOMETRY,
        "across = _hypot(*self.doppler_gradient) * _sin(self.gradient_angle)",
        "across = _hypot(*self.doppler_gradient)",
        ("tests/budget/test_defects.py::test_cross_range_resolution_of_gradients_that_are_not_at_right_angles",),
    ),
    Mutant(
        "(29): sign",
        _PIECES,
        "evaluators.full_ground_inverse(*look, *rate)",
        "evaluators.full_ground_inverse(*[-part for part in look], *rate)",
        (_POINTS_OF_29,),
    ),
    Mutant(
        "(29): without the points' own Q",
        _PIECES,
        "state.at(piece.time)",
        "state.at(0.0)",
        (_POINTS_OF_29,),
    ),
    Mutant(
        "(29): segments at T/2",
        _POINT,
        "times = np.array([-T / 3, 0.0, T / 3])",
        "times = np.array([-T / 2, 0.0, T / 2])",
        (_POINTS_OF_29,),
    ),
    Mutant(
        "(28): twice the slope",
        _POINT,
        "np.interp(times, fine, remaining_range), np.interp(times, fine, slope)",
        "np.interp(times, fine, remaining_range), 2 * np.interp(times, fine, slope)",
        (_POINTS_OF_29,),
    ),
    Mutant(
        "(27): sign of the value",
        _POINT,
        "zip(times, values, slopes, strict=True)]\n    model",
        "zip(times, -values, slopes, strict=True)]\n    model",
        (_POINTS_OF_29,),
    ),
    Mutant(
        "simulate: half of a clock error",
        "bisar_budget/simulator/flown_errors.py",
        "tuple(size * float(term)",
        "tuple(size / 2 * float(term)",
        (f"{_IMAGES}test_the_clock_of_a_simulated_image_has_the_coverage_factor",),
    ),
    Mutant(
        "registry: an error of both platforms has the id of one platform",
        _KINDS,
        'self.common_id_form if self.common_id_form and owner == "mission" else',
        'self.common_id_form if self.common_id_form and owner != "mission" else',
        ("tests/contract/test_registry.py::test_the_ids_of_rows_are_those_of_the_contract",),
    ),
    Mutant(
        "registry: a wrong height of the scene is flown as a time tag",
        "bisar_budget/error_kinds/path_kinds.py",
        'flown_as="height"',
        'flown_as="time_tag"',
        ("tests/simulate/test_flown_errors.py::test_a_wrong_height_of_the_scene_is_flown",),
    ),
    Mutant(
        "registry: the file states the distribution of the scene's height",
        "bisar_budget/error_kinds/path_kinds.py",
        "distribution=BOUND",
        "distribution=AS_STATED",
        ("tests/contract/test_kind_objects.py::test_a_size_means_what_its_kind_does_with_it",),
    ),
    Mutant(
        "registry: a size has the key of another one",
        "bisar_budget/error_kinds/clock_kinds.py",
        'key="acceleration_sensitivity"',
        'key="aging"',
        ("tests/contract/test_kind_objects.py::test_the_mission_reader_accepts_a_size_at_its_path",),
    ),
    Mutant(
        "registry: an error of velocity moves the platform twice as far",
        "bisar_budget/error_kinds/path_kinds.py",
        "(np.ones_like(times), times, times**2 / 2)",
        "(np.ones_like(times), 2 * times, times**2 / 2)",
        ("tests/theory/test_full_model.py",),
    ),
    Mutant(
        "registry: a registered kind is not flown",
        "bisar_budget/simulator/flown_errors.py",
        "Course(times, size * np.array(",
        "Course(times, 0 * np.array(",
        ("tests/contract/test_extending.py::test_simulate_flies_it",),
    ),
    Mutant(
        "registry: the size of a registered kind is added to its motion",
        "bisar_budget/sampling/draws.py",
        "moved = [component * sizes for component in source.way_of(platform)]",
        "moved = [component + sizes for component in source.way_of(platform)]",
        ("tests/contract/test_registry.py::test_large_draws_of_a_registered_kind_are_those_of_its_motion",),
    ),
    Mutant(
        "plot: segments of twice their length",
        _PLOT,
        "half = (times[1] - times[0]) / 2",
        "half = times[1] - times[0]",
        (f"{_FIGURES_3_TO_7}TestFigure3::test_segments_are_thirds_of_the_aperture_and_touch_the_curve",),
    ),
    Mutant(
        "plot: images transposed",
        _PLOT,
        "        picture.corners[..., 0],\n        picture.corners[..., 1],\n",
        "        picture.corners[..., 1],\n        picture.corners[..., 0],\n",
        (f"{_FIGURES_3_TO_7}TestDrawing::test_the_figure_draws_the_sheet",),
    ),
    Mutant(
        "plot: images mirrored",
        _PLOT,
        "        picture.corners[..., 0],\n",
        "        -picture.corners[..., 0],\n",
        (f"{_FIGURES_3_TO_7}TestDrawing::test_the_figure_draws_the_sheet",),
    ),
    Mutant(
        "plot: image data transposed",
        _PLOT,
        "return np.where(is_missing, math.nan, _decibels(fine, peak)), corners",
        "return np.where(is_missing, math.nan, _decibels(fine, peak)), corners[..., ::-1]",
        (f"{_FIGURES_3_TO_7}TestPictures::test_targets_stand_where_they_are_in_every_picture",),
    ),
    Mutant(
        "plot: pixels half a step off",
        _PLOT,
        "(np.arange(count * factor + 1) - 0.5) / factor",
        "np.arange(count * factor + 1) / factor",
        (f"{_FIGURES_3_TO_7}TestPictures::test_targets_stand_where_they_are_in_every_picture",),
    ),
    Mutant(
        "plot: turned the other way",
        _PLOT,
        "turn = np.array([[cosine, -sine], [sine, cosine]])",
        "turn = np.array([[cosine, sine], [-sine, cosine]])",
        (f"{_FIGURES_3_TO_7}TestPictures::test_targets_stand_where_they_are_in_every_picture",),
    ),
    Mutant(
        "plot: points mirrored about the middle one",
        _PLOT,
        'panel.plot(*drawn.points.T, "o-"',
        'panel.plot(*(2 * drawn.points[1] - drawn.points).T, "o-"',
        (f"{_FIGURES_3_TO_7}TestDrawing::test_the_figure_draws_the_sheet",),
    ),
    Mutant(
        "plot: points with x for y",
        _PLOT,
        'panel.plot(*drawn.points.T, "o-"',
        'panel.plot(*drawn.points.T[::-1], "o-"',
        (f"{_FIGURES_3_TO_7}TestDrawing::test_the_figure_draws_the_sheet",),
    ),
    Mutant(
        "autofocus: a correction that amplifies by 1 %",
        "bisar_budget/simulator/autofocus.py",
        "    turn = np.exp(-1j * phase)\n    focused = ",
        "    turn = 1.01 * np.exp(-1j * phase)\n    focused = ",
        (f"{_IMAGES}test_autofocus_never_beats_the_error_free_image_within_the_aperture",),
    ),
    Mutant(
        "Table I: sign of the cubic term of an acceleration, in the evaluators",
        _EVALUATORS,
        "(0.0, 0.0, constant_y*shared_3, linear_y*shared_4),  # acceleration y",
        "(0.0, 0.0, constant_y*shared_3, -linear_y*shared_4),  # acceleration y",
        ("tests/theory/test_against_exact_ranges.py", "tests/verify/test_verify.py::TestTogether"),
    ),
    Mutant(
        "Table I as transcribed: sign of an expression",
        "specs/published/table_1.csv",
        ",-atilde_yt*v_yt/(2*R_t)",
        ",atilde_yt*v_yt/(2*R_t)",
        ("tests/theory/test_transcription.py",),
    ),
    Mutant(
        "Table II as transcribed: factor of an expression",
        "specs/published/table_2.csv",
        ",lambda/(2*T**2*sin(thetabar_t))",
        ",lambda/(4*T**2*sin(thetabar_t))",
        ("tests/theory/test_transcription.py",),
    ),
    Mutant(
        "verify: refocused against twice the budget",
        _PHASES,
        "is_met = remaining_phase <= budget * (1 + TOLERANCE_FRACTION)",
        "is_met = remaining_phase <= 2 * budget * (1 + TOLERANCE_FRACTION)",
        (f"{_BORDERS}TestRefocused",),
    ),
    Mutant(
        "verify: ratio of the cubic phase inverted",
        _PHASES,
        "verdict = compare(measured / requirement - 1, TOLERANCE_FRACTION)",
        "verdict = compare(requirement / measured - 1, TOLERANCE_FRACTION)",
        (f"{_BORDERS}TestCubic",),
    ),
    Mutant(
        "verify: vibration confirmed within 2 dB, where it is conservative",
        _NOISE,
        "TOLERANCE_DB = 0.5",
        "TOLERANCE_DB = 2.0",
        (f"{_BORDERS}TestVibration::test_noise_1_db_inside_is_conservative",),
    ),
    Mutant(
        "verify: vibration confirmed within 2 dB, where it is optimistic",
        _NOISE,
        "TOLERANCE_DB = 0.5",
        "TOLERANCE_DB = 2.0",
        (f"{_BORDERS}TestVibration::test_noise_that_the_rule_of_small_phases_underrates_is_optimistic",),
    ),
    Mutant(
        "verify: confirmed within 5.5 %",
        _PHASES,
        "TOLERANCE_FRACTION = 0.05 ",
        "TOLERANCE_FRACTION = 0.055 ",
        (_FIVE_PERCENT,),
    ),
    Mutant(
        "verify: confirmed within 4.5 %",
        _PHASES,
        "TOLERANCE_FRACTION = 0.05 ",
        "TOLERANCE_FRACTION = 0.045 ",
        (_FIVE_PERCENT,),
    ),
    Mutant(
        "verify: the phase inside a limit ignored",
        _PHASES,
        "falls_inside = inside is not None and inside >= measured",
        "falls_inside = False",
        (f"{_BORDERS}TestThroughTheLimit",),
    ),
    Mutant(
        "verify: the phase beyond a limit ignored",
        _PHASES,
        "(beyond is None or beyond > measured)",
        "True",
        (f"{_BORDERS}TestThroughTheLimit",),
    ),
    Mutant(
        "simulate: noise by 20 log",
        _POINT,
        "10 ** (power / 10)",
        "10 ** (power / 20)",
        (f"{_SEAMS}test_noise_is_a_power",),
    ),
    Mutant(
        "simulate: a grid with its axes swapped",
        "bisar_budget/simulator/targets.py",
        "Target(spacing * (column - (columns - 1) / 2), spacing * (row - (rows - 1) / 2))",
        "Target(spacing * (row - (rows - 1) / 2), spacing * (column - (columns - 1) / 2))",
        (f"{_SEAMS}test_a_grid_has_its_columns_along_east",),
    ),
    Mutant(
        "simulate: sensors flown without the coverage factor",
        "bisar_budget/simulator/realisations.py",
        "Course(self.times, self.factor * series[0])",
        "Course(self.times, series[0])",
        (f"{_SEAMS}test_the_coverage_factor_is_in_the_time_series_of_sensors_and_clocks",),
    ),
    Mutant(
        "simulate: clocks flown without the coverage factor",
        "bisar_budget/simulator/realisations.py",
        "series = self.factor * phase_courses",
        "series = phase_courses",
        (f"{_SEAMS}test_the_coverage_factor_is_in_the_time_series_of_sensors_and_clocks",),
    ),
    Mutant(
        "verify: one optimistic mission of several passes",
        "bisar_budget/cli/images.py",
        'any(mission.status == "fail" for mission in verified)',
        'all(mission.status == "fail" for mission in verified)',
        (f"{_SEAMS}test_one_optimistic_mission_of_several_breaks_verify",),
    ),
    Mutant(
        "verify: what autofocus leaves is met within 20 %",
        _PHASES,
        "is_met = remaining_phase <= budget * (1 + TOLERANCE_FRACTION)",
        "is_met = remaining_phase <= budget * (1 + 4 * TOLERANCE_FRACTION)",
        (f"{_BORDERS}TestRefocused",),
    ),
    Mutant(
        "SARIF: an expired waiver suppresses",
        "bisar_budget/report/formats/annotations.py",
        """    if status != "waived" or not waivers:
        return {}
    waiver = next(waiver for waiver in waivers if not waiver.is_expired)""",
        """    if not waivers:
        return {}
    waiver = waivers[0]""",
        (f"{_SEAMS}test_only_a_waiver_that_holds_suppresses",),
    ),
    Mutant(
        "SARIF: without what passes by autofocus alone",
        "bisar_budget/findings/status.py",
        'sarif="note", github="notice", junit="remark", verdict="Complies, with autofocus"',
        'github="notice", junit="remark", verdict="Complies, with autofocus"',
        (f"{_SEAMS}test_what_passes_by_autofocus_alone_is_a_result_of_sarif",),
    ),
    Mutant(
        "Monte Carlo: intervals of 90 % called 95 %",
        "bisar_budget/sampling/probability.py",
        "_QUANTILE_SIGMA = 1.959963984540054 ",
        "_QUANTILE_SIGMA = 1.6448536269514722 ",
        (f"{_SEAMS}test_an_interval_of_95_percent_is_that",),
    ),
    Mutant(
        "units: ft/s/sqrt(h) without the root of an hour",
        "bisar_budget/units.py",
        '"ft/s/sqrt(h)": 0.3048 * _PER_ROOT_HOUR',
        '"ft/s/sqrt(h)": 0.3048',
        ("tests/house/test_units.py::test_every_unit_has_the_factor_of_its_parts",),
    ),
    Mutant(
        "SOURCE_DATE_EPOCH as a local day",
        "bisar_budget/questions/outside.py",
        "fromtimestamp(int(epoch), dt.UTC)",
        "fromtimestamp(int(epoch))",
        (f"{_SEAMS}test_the_day_of_an_epoch_is_that_of_utc",),
    ),
    Mutant(
        "seam: autofocus gain on the limit of a slow vibration",
        _PHASES,
        "size = lines_of(mission, name)[entry], budget / float(tone.per_metre.judged(1.0)[0])",
        "size = lines_of(mission, name)[entry], 2 * budget / float(tone.per_metre.judged(1.0)[0])",
        (f"{_SEAMS}test_autofocus_gives_a_slow_vibration_no_larger_limit",),
    ),
    Mutant(
        "seam: text of verify, the nearest displacement",
        "bisar_budget/report/answers/verify_answer.py",
        "distance, row_id = max(distances)",
        "distance, row_id = min(distances)",
        (f"{_SEAMS}test_verify_names_the_image_that_is_farthest_off",),
    ),
    Mutant(
        "seam: text of verify, the smallest turn",
        "bisar_budget/report/answers/verify_answer.py",
        "angle, row_id = max(angles)",
        "angle, row_id = min(angles)",
        (f"{_SEAMS}test_verify_names_the_image_that_is_farthest_off",),
    ),
    Mutant(
        "seam: Monte Carlo counts twice what quadratic and cubic share",
        "bisar_budget/analysis/variables.py",
        "covariance = covariance - np.multiply.outer(column, column)",
        "covariance = covariance + 0 * np.multiply.outer(column, column)",
        (f"{_SEAMS}test_what_a_cubic_shares_with_the_quadratic_is_drawn_once",),
    ),
    Mutant(
        "seam: the clock is nobody's where an error is relaxed",
        "bisar_budget/questions/sensitivity.py",
        'is_owed = row.subject.owner in (owner, "clock" if owner == "receiver" else owner)',
        "is_owed = row.subject.owner == owner",
        (f"{_SEAMS}test_a_clock_is_the_receivers_where_another_error_is_relaxed",),
    ),
    Mutant(
        "seam: a location that images contradict is a warning",
        "bisar_budget/budget/verdicts.py",
        'row._replace(status="fail", reason=reason, refuted=refuted)',
        'row._replace(status="warn", reason=reason, refuted=refuted)',
        (
            "tests/verify/test_verify_reports.py::TestCheckWithImages::test_a_location_that_the_image_contradicts_fails",
        ),
    ),
    Mutant(
        "seam: level of a power as of an amplitude",
        _NOISE,
        "return 10 * math.log10(max(lost, _MIN_ENERGY_FRACTION) / (self.energy * remaining_energy))",
        "return 20 * math.log10(max(lost, _MIN_ENERGY_FRACTION) / (self.energy * remaining_energy))",
        ("tests/verify/test_noise_image.py",),
    ),
    Mutant(
        "seam: level of an echo as of a power",
        _NOISE,
        "level = 20 * math.log10(peaks[0] / peaks[1])",
        "level = 10 * math.log10(peaks[0] / peaks[1])",
        ("tests/verify/test_vibration.py",),
    ),
    Mutant(
        "a void position dates a log",
        "bisar_budget/paths/nmea.py",
        'if fields[1] != "A" or not fields[8]:',
        'if fields[1] != "A" and not fields[8]:',
        ("tests/paths/test_nmea.py::test_a_void_sentence_dates_nothing",),
    ),
    Mutant(
        "an SBET counts in TAI",
        "bisar_budget/paths/sbet.py",
        'hold_to_scale("gps", keys, name)\n    hold_to_ellipsoid',
        'hold_to_scale("tai", keys, name)\n    hold_to_ellipsoid',
        ("tests/paths/test_sbet.py::test_a_mission_file_may_say_no_other_time_than_the_log_counts",),
    ),
    Mutant(
        "tones of an oscillator: cycles as a frequency over the aperture",
        "bisar_budget/simulator/realisations.py",
        "        and tone.frequency * T >= SLOWEST_ECHO_CYCLES",
        "        and tone.frequency / T >= SLOWEST_ECHO_CYCLES",
        (
            "tests/simulate/test_realisations.py::test_a_tone_of_an_oscillator_is_flown_from_one_cycle_per_aperture_on",
        ),
    ),
    Mutant(
        "what a covariance states is not declared in CPHD",
        "bisar_budget/formats/exporting.py",
        "elif error.covariance is None and (common is None",
        "elif error.covariance is None or (common is None",
        ("tests/formats/test_export.py::TestBack::test_a_covariance",),
    ),
)
