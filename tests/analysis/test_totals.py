"""Quantiles of all errors together, against draws of errors whose effects come from exact ranges of the tests."""

import math
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest
import yaml

import bisar_budget as bb
from tests.image_point import _LEGENDRE, _MEAN, Collection, Floats, flight, no_error

DRAWS, CHUNK = 1_000_000, 100_000
CONFIDENCES = (0.9, 0.95, 0.997)
AXES, KINDS, UNITS = "xyz", ("position", "velocity", "acceleration"), ("m", "m/s", "m/s^2")
PLATFORMS = ("transmitter", "receiver")
SIZES = {"position": 0.5, "velocity": 5e-3, "acceleration": 2e-3}
KEYS = ("quadratic_phase_error", "cubic_phase_error", "location_error")
SMALL = 1e-3  # of a declared size; the effects of errors of this size are proportional to it

ALL = [pytest.param(seed, marks=() if seed < 3 else pytest.mark.thorough) for seed in range(20)]


class DrawnError(NamedTuple):
    """An error along one axis: platform, kind and axis by index, size, bias and distribution."""

    platform: int
    kind: int
    axis: int
    size: float
    bias: float
    distribution: str

    @property
    def id(self) -> str:
        return f"{PLATFORMS[self.platform]}.{KINDS[self.kind]}.{AXES[self.axis]}"

    def draw(self, generator: np.random.Generator, count: int) -> Floats:
        if self.distribution == "normal":
            return self.bias + self.size * generator.standard_normal(count)
        uniform = generator.uniform(-1, 1, count)
        return self.bias + self.size * (uniform if self.distribution == "uniform" else np.sign(uniform))


class Drawn(NamedTuple):
    """A mission of a seed, and its errors."""

    document: dict[str, Any]
    errors: list[DrawnError]
    collection: Collection

    def effects(self) -> tuple[Floats, Floats]:
        """Effects of a unit of each error: P₂, cubic, east and north (n, 4), and the form of the equal-loss phase.

        The square of the equal-loss phase of errors x is xᵀMx; the second array is M (n, n).
        """
        signed, left = [], []
        for error in self.errors:
            size = SMALL * max(error.size, abs(error.bias))
            vector: list[tuple[float, float, float]] = [(0.0, 0.0, 0.0)] * 3
            way = [0.0, 0.0, 0.0]
            way[error.axis] = size
            vector[error.kind] = (way[0], way[1], way[2])
            moves = [no_error, no_error]
            moves[error.platform] = flight(*vector)
            collection = replace(self.collection, errors=(moves[0], moves[1]))
            response = collection.least_variance_point(1)
            effects = (response.quadratic_rad, response.cubic_rad, *response.point)
            signed.append(np.array(effects) / size)
            left.append(collection.left(response.point, 1.0) / size)
        k, b2 = self.collection.wavenumber, (self.collection.bandwidth / self.collection.center_frequency) ** 2 / 12
        ranges = np.array(left)
        means = ranges @ _MEAN
        form = k**2 * ((1 + b2) * (ranges * _MEAN) @ ranges.T - np.outer(means, means))
        parts = (ranges * _MEAN) @ _LEGENDRE.T * (2 * np.arange(4) + 1)
        rest = ranges - parts @ _LEGENDRE
        form -= 4 / 175 * np.outer(*[2.5 * k * parts[:, 3]] * 2) + k**2 * (rest * _MEAN) @ rest.T
        return np.array(signed), 45 / 4 * form


def drawn_mission(seed: int, combine: str = "rss") -> Drawn:
    """An aircraft or drone mission with errors of all distributions, some with biases, wide or narrow in band."""
    generator = np.random.default_rng(1000 + seed)
    frequency = 10 ** generator.uniform(9, 10.2)
    bandwidth = frequency * (0.03 if seed % 4 else 0.002)
    aperture = generator.uniform(1.5, 5)
    document: dict[str, Any] = {
        "schema_version": 1,
        "name": f"drawn {seed}",
        "radar": {"center_frequency": f"{frequency} Hz", "bandwidth": f"{bandwidth} Hz"},
        "collection": {"aperture_time": f"{aperture} s"},
        "platforms": {},
        "allocation": {"combine": combine},
    }
    errors, paths = [], []
    for platform, (low, high) in enumerate(((8e3, 30e3), (2e3, 8e3))):
        distance, azimuth = generator.uniform(low, high), generator.uniform(-0.3, 0.3) + platform * 0.9
        height, speed = distance * generator.uniform(0.15, 0.4), generator.uniform(40, 150)
        position = (distance * math.cos(azimuth), distance * math.sin(azimuth), height)
        heading = azimuth + math.pi / 2 + generator.uniform(-0.4, 0.4)
        velocity = (speed * math.cos(heading), speed * math.sin(heading), 0.0)
        paths.append(flight(position, velocity))
        section: dict[str, Any] = {"distribution": {}}
        for kind, name in enumerate(KINDS[: 3 if seed % 2 else 2]):
            distribution = str(generator.choice(["normal", "uniform", "bound"], p=[0.5, 0.35, 0.15]))
            sizes = SIZES[name] * 10 ** generator.uniform(-1, 0.3, 3)
            biases = sizes * generator.uniform(-1.5, 1.5, 3) * (generator.uniform() < 0.4)
            section["distribution"][name] = distribution
            section[name] = {
                "sigma": [f"{size!r} {UNITS[kind]}" for size in sizes.tolist()],
                "bias": [f"{bias!r} {UNITS[kind]}" for bias in biases.tolist()],
            }
            errors += [DrawnError(platform, kind, axis, sizes[axis], biases[axis], distribution) for axis in range(3)]
        document["platforms"][PLATFORMS[platform]] = {
            "position": [f"{x!r} m" for x in position],
            "velocity": [f"{v!r} m/s" for v in velocity],
            "motion_error": section,
        }
    collection = Collection(frequency, bandwidth, aperture, (paths[0], paths[1]), (no_error, no_error))
    return Drawn(document, errors, collection)


def with_confidence(document: dict[str, Any], confidence: float, limits: dict[str, str] | None = None) -> bb.Mission:
    limits = limits or {"quadratic_phase_error": "90 deg", "cubic_phase_error": "90 deg", "location_error": "1 km"}
    requirements = {key: {"limit": limit, "confidence": confidence} for key, limit in limits.items()}
    return bb.loads(yaml.safe_dump({**document, "requirements": requirements}, allow_unicode=True))


@cache
def drawn_sizes(seed: int) -> dict[str, Floats]:
    """Quadratic phase of equal loss, cubic phase and displacement of each draw of a mission."""
    mission = drawn_mission(seed)
    signed, form = mission.effects()
    squares, vectors = np.linalg.eigh(form)
    root = vectors * np.sqrt(np.maximum(squares, 0.0))
    generator = np.random.default_rng(7)
    sizes: dict[str, list[Floats]] = {key: [] for key in KEYS}
    for _ in range(DRAWS // CHUNK):
        drawn = np.array([error.draw(generator, CHUNK) for error in mission.errors])
        sizes["quadratic_phase_error"].append(np.sqrt(np.square(root.T @ drawn).sum(axis=0)))
        _, cubic, east, north = signed.T @ drawn
        sizes["cubic_phase_error"].append(np.abs(cubic))
        sizes["location_error"].append(np.hypot(east, north))
    return {key: np.concatenate(parts) for key, parts in sizes.items()}


@pytest.mark.parametrize("seed", ALL)
def test_quantiles_of_all_errors_are_those_of_draws(seed: int) -> None:
    """Half a percent is promised; the draws know a probability of 95 % to 2e-4."""
    mission = drawn_mission(seed)
    drawn = drawn_sizes(seed)
    for confidence in CONFIDENCES:
        result = bb.check(with_confidence(mission.document, confidence))
        for key in KEYS:
            reached = result.requirements[key].reached
            assert reached is not None
            below, above = ((drawn[key] <= factor * reached).mean() for factor in (0.98, 1.02))
            assert below < confidence < above, (key, confidence)
            assert reached == pytest.approx(np.quantile(drawn[key], confidence), rel=7e-3), (key, confidence)


@pytest.mark.parametrize("seed", ALL)
def test_both_sides_of_a_limit(seed: int) -> None:
    mission = drawn_mission(seed)
    sizes = {key: np.quantile(values, 0.95) for key, values in drawn_sizes(seed).items()}
    for factor, is_met in ((1.02, True), (0.98, False)):
        for key, unit in zip(KEYS, ("rad", "rad", "m"), strict=True):
            limit = f"{factor * sizes[key]!r} {unit}".replace("np.float64(", "").replace(")", "")
            if unit == "rad" and not 1e-6 <= factor * sizes[key] <= 6:
                continue
            result = bb.check(with_confidence(mission.document, 0.95, {key: limit}))
            row = result[f"mission.{key}"]
            assert (row.utilization <= 1) == is_met, (key, factor)


@pytest.mark.parametrize("seed", ALL)
def test_rows_are_quantiles_of_one_error(seed: int) -> None:
    """With `each`, the size of a row at its own quantile; the draws are of the one error."""
    mission = drawn_mission(seed, "each")
    signed, _ = mission.effects()
    largest = max(np.hypot(*signed[index, 2:]) * error.size for index, error in enumerate(mission.errors))
    limit = round(4 * largest, 3)  # beyond some ten metres an effect is not proportional to its error
    result = bb.check(with_confidence(mission.document, 0.95, {"location_error": f"{limit} m"}))
    generator = np.random.default_rng(3)
    for index, error in enumerate(mission.errors):
        per_unit = np.hypot(*signed[index, 2:])
        moved = np.quantile(np.abs(error.draw(generator, DRAWS)), 0.95, method="inverted_cdf") * per_unit
        row = result[error.id]
        if row.binding_requirement != "location_error":
            continue
        assert row.utilization == pytest.approx(moved / limit, rel=7e-3), error
        assert row.allowable is not None
        widened = error._replace(size=row.allowable)
        kept = (np.abs(widened.draw(generator, DRAWS)) * per_unit <= limit).mean()
        if error.distribution != "bound":
            assert kept == pytest.approx(0.95, abs=4e-3), error


@pytest.mark.parametrize("seed", ALL)
def test_sum_adds_the_quantiles_at_worst_signs(seed: int) -> None:
    mission = drawn_mission(seed, "sum")
    signed, _ = mission.effects()
    generator = np.random.default_rng(3)
    quantiles = np.array(
        [np.quantile(np.abs(error.draw(generator, DRAWS)), 0.95, method="inverted_cdf") for error in mission.errors]
    )
    moves = signed[:, 2:] * quantiles[:, None]
    angles = np.linspace(0, math.pi, 3601)
    longest = np.abs(moves @ np.array((np.cos(angles), np.sin(angles)))).sum(axis=0).max()
    result = bb.check(with_confidence(mission.document, 0.95))
    assert result.requirements["location_error"].reached == pytest.approx(longest, rel=7e-3)
    assert result.requirements["cubic_phase_error"].reached == pytest.approx(
        np.abs(signed[:, 1]) @ quantiles, rel=7e-3
    )
