"""Independent variables of all errors: tones against exact ranges in all phases, hidden phases against those of rows.

The reference of tones is `tests.image_point`, which has no line of the package.
"""

import math
from typing import Any

import numpy as np
import pytest
import yaml

import bisar_budget as bb
from bisar_budget.analysis.analysis import Analysis, by_nodes
from bisar_budget.analysis.variables import CONSTANT, FIRST_HIDDEN_INDEX, ErrorVariables, Variable, variables_of
from bisar_budget.effects.slow_tones import TONE_PHASES_RAD
from bisar_budget.mission.load import load_mission
from bisar_budget.mission.stacked import stacked
from tests.conftest import mission_file
from tests.effects.test_random_errors import MISSION, OSCILLATORS
from tests.effects.test_slow_tones import RADARS, mission
from tests.image_point import Collection, Floats, no_error

PHASES = np.arange(24) * math.pi / 12
TELEVISION = {
    "transmitter": {"position": [-18e3, 9e3, 420.0], "velocity": [0.0, 0.0, 0.0]},
    "receiver": {"position": [-2e3, -7e3, 2500.0], "velocity": [-65.0, 8.0, 0.0]},
}
RADARS = RADARS | {"DVB-T": (602e6, 7.61e6, TELEVISION)}


@pytest.fixture(autouse=True)
def radars(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.effects.test_slow_tones.RADARS", RADARS)


def one_phase(variable: Variable, phase: float) -> Floats:
    """Quadratic and cubic phase, displacement and hidden phase in one phase of a tone."""
    effects = math.cos(phase) * np.array(variable.effects) + math.sin(phase) * np.array(variable.quadrature)
    return np.array([*effects[:FIRST_HIDDEN_INDEX], np.linalg.norm(effects[FIRST_HIDDEN_INDEX:])])


def by_exact_ranges(given: bb.Mission, shaken: str, axis: Any, size: float, phase: float) -> Floats:
    """The same of the image point of exact ranges. `axis` is a vector, or None for the turning line of sight."""
    paths = tuple(
        lambda times, path=path: np.stack(np.broadcast_arrays(*path.place(times)), axis=1)
        for path in given.geometry.both
    )
    (line,) = getattr(given.platforms, shaken).motion_error.vibration.sinusoidal

    def moved(times: Floats) -> Floats:
        course = size * np.cos(2 * math.pi * line.frequency * times + phase)
        if axis is not None:
            return np.outer(course, axis)
        path = paths[0 if shaken == "transmitter" else 1](times)
        return course[:, None] * path / np.linalg.norm(path, axis=1)[:, None]

    errors = (moved, no_error) if shaken == "transmitter" else (no_error, moved)
    T, radar = given.collection.aperture_time, given.radar
    seen = Collection(radar.center_frequency, radar.bandwidth, T, paths, errors).least_variance_point()
    hidden = math.sqrt(max(seen.equal_loss_rad**2 - seen.quadratic_rad**2, 0.0))
    return np.array([seen.quadratic_rad, seen.cubic_rad, *seen.point, hidden])


def rms(values: Any) -> Floats:
    return np.sqrt(np.square(values).mean(axis=0))


@pytest.mark.parametrize("cycles", [0.3, 0.95])
@pytest.mark.parametrize("shaken", ["transmitter", "receiver"])
@pytest.mark.parametrize("name", ["X", "DVB-T"])
@pytest.mark.parametrize("amplitude", [1e-4, [3e-4, 2e-4, 1e-4]], ids=["sight", "axes"])
def test_a_slow_tone_has_in_each_phase_the_effects_of_exact_ranges(
    name: str, shaken: str, cycles: float, amplitude: Any
) -> None:
    given = mission(name, shaken, amplitude, cycles / 6, collection={"aperture_time": 6.0})
    variables = variables_of(Analysis(given))
    assert {variable.of for variable in variables} == {f"{shaken}.vibration.sinusoidal.0"}
    axes = [None] if isinstance(amplitude, float) else np.eye(3)
    sizes = amplitude if isinstance(amplitude, list) else [amplitude]
    assert len(variables) == len(sizes)
    for variable, axis, size in zip(variables, axes, sizes, strict=True):
        got = np.array([one_phase(variable, phase) for phase in PHASES])
        wanted = np.array([by_exact_ranges(given, shaken, axis, size, phase) for phase in PHASES])
        # The band also hides a little of what is beyond the cubic, which the parts leave out.
        of_band = np.array([0, 0, 0, 0, 2e-3]) * rms(wanted)[:2].max()
        assert np.all(rms(got - wanted) <= 0.01 * rms(wanted) + of_band + 1e-7)
        covariance = [variable.covariance(index, index) for index in range(FIRST_HIDDEN_INDEX)]
        assert np.sqrt(covariance) == pytest.approx(rms(wanted)[:FIRST_HIDDEN_INDEX], rel=0.01, abs=1e-7)


@pytest.mark.parametrize("cycles", [1.3, 4.2])
def test_a_fast_tone_only_displaces(cycles: float) -> None:
    """In each phase as exact ranges do; its phases are those of echoes, which no draw has."""
    given = mission("X", "receiver", [3e-4, 2e-4, 0.0], cycles / 6)
    for variable, axis, size in zip(variables_of(Analysis(given)), np.eye(3), [3e-4, 2e-4], strict=False):
        got = np.array([one_phase(variable, phase) for phase in PHASES])
        wanted = np.array([by_exact_ranges(given, "receiver", axis, size, phase) for phase in PHASES])
        assert np.all(rms(got - wanted)[2:4] <= 0.01 * rms(wanted)[2:4])
        assert not got[:, [0, 1, 4]].any()
        assert variable.motion is None


@pytest.mark.parametrize("name", ["X", "P", "DVB-T"])
@pytest.mark.parametrize("aperture", [6.0, 30.0])
def test_phases_of_a_slow_tone_are_those_of_its_row(name: str, aperture: float) -> None:
    """P band over 30 s turns by more than a radian: all beyond the cubic is hidden."""
    given = mission(name, "receiver", [1e-4, 3e-4, 2e-4], 0.7 / aperture, collection={"aperture_time": aperture})
    analysis = Analysis(given)
    assert analysis.exact.is_turned[0] == (name == "P" and aperture == 30)
    (tone,) = analysis.slow_tones.values()
    for axis, variable in enumerate(variables_of(analysis)):
        assert len(variable.effects) == (10 if analysis.exact.is_turned[0] else 8)
        got = np.array([one_phase(variable, phase) for phase in TONE_PHASES_RAD])[:, [0, 1, 4]]
        declared = tone.declared
        wanted = np.stack([each[axis, :, 0] for each in (declared.quadratics, declared.cubics, declared.hiddens)], 1)
        assert np.all(rms(got - wanted) <= 0.01 * rms(wanted) + 1e-6)


def test_a_spur_displaces_as_its_row_says() -> None:
    """The row has east and north each at its worst phase: √2 of the rms."""
    text = MISSION.rstrip() + OSCILLATORS
    tree = yaml.safe_load(text)
    tree["platforms"]["receiver"]["oscillator"]["spurs"] = {"5 Hz": "-40 dBc", "80 Hz": "-30 dBc"}
    analysis = Analysis(bb.loads(yaml.safe_dump(tree)))
    tones = [variable for variable in variables_of(analysis) if variable.is_tone]
    assert len(tones) == 2
    for variable, displaced in zip(tones, analysis.displacing_tones, strict=True):
        assert variable.of == displaced.subject.id
        sigmas = [math.sqrt(2 * variable.covariance(index, index)) for index in (2, 3)]
        assert sigmas == pytest.approx(displaced.by("full")[:, 0], rel=1e-9)
        assert not variable.affects(0)
        assert not variable.hides


@pytest.mark.parametrize(
    "file", ["dvbt_aircraft", "circling_drone", "tandem_l", "gps_aircraft_direct_path", "standard_rate_turn"]
)
def test_the_hidden_phase_of_a_variable_is_that_of_its_row(file: str) -> None:
    """Of stated errors to first order; of random errors as a root-sum-square of their variables."""
    given = load_mission(mission_file(file))
    analysis = Analysis(given)
    factor, variables = given.allocation.coverage_factor, variables_of(analysis)
    for variable in variables:
        if len(variable.parts) == 1:
            ((source, size),) = variable.parts
            wanted = analysis.full.hidden_per_unit(source) * size
            got = np.linalg.norm(variable.effects[FIRST_HIDDEN_INDEX:])
            assert got == pytest.approx(wanted, rel=1e-3, abs=1e-9)
            assert variable.effects[:2] == (source.full.qpe * size, source.full.cubic * size)
    for error in analysis.random:
        ours = [np.array(variable.effects) for variable in variables if variable.of == error.id]
        if ours and error.declared:
            sigmas = np.sqrt(sum(np.square(effects) for effects in ours))
            scale = error.declared / (factor if error.is_covered else 1.0)
            effect = error.full
            wanted = np.array([effect.quadratic, effect.cubic, effect.east, effect.north, effect.hidden]) * scale
            got = [*sigmas[:FIRST_HIDDEN_INDEX], np.linalg.norm(sigmas[FIRST_HIDDEN_INDEX:])]
            known = ~np.isnan(wanted)
            assert np.array(got)[known] == pytest.approx(wanted[known], rel=1e-6, abs=1e-12)


def test_variables_of_each_of_many_cases_are_those_of_its_mission() -> None:
    """Apertures, sizes and tones that vary; one frequency makes the tone fast in one case."""
    missions = []
    for aperture, size, frequency in ((6.0, "1 cm/s", 0.1), (4.0, "3 cm/s", 0.2), (6.0, "2 cm/s", 0.3)):
        tree = yaml.safe_load(MISSION)
        tree["collection"]["aperture_time"] = aperture
        error = tree["platforms"]["receiver"]["motion_error"]
        error |= {"velocity": size, "vibration": {"sinusoidal": [{"amplitude": "1 mm", "frequency": frequency}]}}
        missions.append(bb.loads(yaml.safe_dump(tree)))
    ((many, indices),) = stacked(missions)
    ((nodes, _, _, geometry),) = by_nodes(many, len(missions), many.geometry)
    analysis = ErrorVariables(Analysis(many, len(missions), geometry=geometry, nodes=nodes))
    for case, index in enumerate(indices):
        alone = variables_of(Analysis(missions[index]))
        ours = analysis.of(case)
        assert [variable.id for variable in ours] == [variable.id for variable in alone]
        for one, other in zip(ours, alone, strict=True):
            assert one.distribution == other.distribution
            scale = np.abs(other.effects).max()
            assert np.array(one.effects) == pytest.approx(np.array(other.effects), rel=1e-3, abs=1e-6 * scale + 1e-10)
            assert np.array(one.quadrature) == pytest.approx(np.array(other.quadrature), rel=1e-6, abs=1e-9)
            assert (one.motion is None) is (other.motion is None)


def test_a_bias_has_the_effects_of_an_error_of_its_size() -> None:
    analysis = Analysis(load_mission(mission_file("dvbt_aircraft")))
    (index,) = (i for i, one in enumerate(analysis.errors.stated) if one.declared)
    assert all(variable.distribution != CONSTANT for variable in variables_of(analysis))
    source = analysis.errors.stated[index]
    analysis.errors.stated[index] = source._replace(bias=-2 * source.declared)
    variable, bias = (one for one in variables_of(analysis) if one.of == source.id)
    assert bias.distribution == CONSTANT
    assert np.array(bias.effects) == pytest.approx(-2 * np.array(variable.effects), rel=1e-9)
