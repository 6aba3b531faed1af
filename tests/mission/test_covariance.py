"""Position-velocity covariances: what is one, how it turns, and what root-sum-square makes of it."""

import math

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from bisar_budget.analysis.variables import independent_columns
from bisar_budget.faults import MissionError
from bisar_budget.geometry import FRAME_AXES
from bisar_budget.mission.load import parse_mission
from tests.conftest import examples, findings, mission_text, row

ERROR = "platforms__receiver__motion_error"
WAVELENGTH = 299_792_458.0 / 10e9
R_R = math.sqrt(2 * 6e3**2 + 2e3**2)
PER_UNIT = math.pi * 40 * 6.0**2 / (2 * R_R * WAVELENGTH)  # Table II rows 1, 2 of the base mission's receiver

unit_interval = st.integers(-1000, 1000).map(lambda thousandths: thousandths / 1000)
loadings = st.lists(st.lists(unit_interval, min_size=6, max_size=6), min_size=6, max_size=6)
sizes = st.lists(st.floats(1e-4, 1e3), min_size=6, max_size=6)


def receiver(covariance, **error):
    return parse_mission(mission_text(**{ERROR: {"covariance": covariance, **error}}))


def faults(covariance, **error) -> list[str]:
    with pytest.raises(MissionError) as refused:
        receiver(covariance, **error)
    return [fault.problem for fault in refused.value.faults]


def sigmas(correlation=None, position="1 m", velocity="5 mm/s"):
    return {"position": position, "velocity": velocity, **({"correlation": correlation} if correlation else {})}


class TestIndependentColumns:
    @given(loadings, st.integers(1, 6))
    def test_they_add_to_the_covariance(self, rows, rank: int) -> None:
        matrix = np.array(rows)[:, :rank] @ np.array(rows)[:, :rank].T
        columns = [column for _, column in independent_columns(matrix)]
        assert len(columns) <= 6
        again = sum((np.multiply.outer(column, column) for column in columns), np.zeros((6, 6)))
        assert again == pytest.approx(matrix, abs=1e-9 * (1e-300 + np.abs(matrix).max()))

    @given(loadings, st.integers(1, 5))
    def test_rounded_correlations_are_no_columns_of_their_own(self, rows, rank: int) -> None:
        """A singular correlation has small pivots after rounding to six decimals, and they are not drawn."""
        factor = np.array(rows)[:, :rank] + np.eye(6)[:, :rank]
        sigmas = np.sqrt((factor**2).sum(axis=1))
        if sigmas.min() < 1e-3:
            return
        correlation = np.round(factor @ factor.T / np.outer(sigmas, sigmas), 6)
        columns = [column for _, column in independent_columns(correlation, 1e-5)]
        again = sum((np.multiply.outer(column, column) for column in columns), np.zeros((6, 6)))
        assert again == pytest.approx(correlation, abs=1e-2)


class TestWhatIsOne:
    @examples(60)
    @given(loadings, sizes, st.integers(1, 6))
    def test_a_product_is_accepted_whatever_its_rank_and_scale(self, rows, scale, rank: int) -> None:
        factor = np.array(scale)[:, None] * np.array(rows)[:, :rank]
        matrix = factor @ factor.T
        covariance = receiver(matrix.tolist()).platforms.receiver.motion_error.covariance
        assert covariance.sigmas == pytest.approx(np.sqrt(np.diag(matrix)))
        back = np.array(covariance.correlation) * np.outer(covariance.sigmas, covariance.sigmas)
        assert back == pytest.approx(matrix, abs=1e-5 * np.outer(scale, scale).max())

    @examples(60)
    @given(st.lists(unit_interval, min_size=15, max_size=15), sizes)
    def test_unit_diagonals_are_accepted_exactly_if_no_eigenvalue_is_negative(self, upper, scale) -> None:
        matrix = np.eye(6)
        matrix[np.triu_indices(6, 1)] = np.array(upper) * 0.6
        matrix = matrix + np.triu(matrix, 1).T
        smallest = float(np.linalg.eigvalsh(matrix)[0])
        assume(abs(smallest + 2.5e-6) > 1e-9)
        full = np.outer(scale, scale) * matrix
        if smallest > -2.5e-6:
            receiver(full.tolist())
            receiver(sigmas(matrix.tolist()))
        else:
            for one in (full.tolist(), sigmas(matrix.tolist())):
                (problem,) = faults(one)
                assert f"{smallest:.3g}" in problem or f"{smallest:.2g}" in problem

    @pytest.mark.parametrize(("half_root", "is_one"), [(0.707107, True), (0.70711, False)])
    def test_six_decimals_of_dependent_errors_pass_five_do_not(self, half_root: float, is_one: bool) -> None:
        """z is (x + y)/√2 of independent x and y: both correlations are 0.70710678."""
        pairs = {"position.x-position.z": half_root, "position.y-position.z": half_root}
        if is_one:
            receiver(sigmas(pairs))
        else:
            assert "eigenvalue -4." in faults(sigmas(pairs))[0]

    def test_pairs_and_matrix_say_the_same(self) -> None:
        matrix = np.diag([1, 1, 1, 25e-6, 25e-6, 25e-6])
        matrix[0, 3] = matrix[3, 0] = 0.5 * 5e-3
        by_matrix = receiver(matrix.tolist()).platforms.receiver.motion_error.covariance
        by_pairs = receiver(sigmas({"position.x-velocity.x": 0.5})).platforms.receiver.motion_error.covariance
        assert by_matrix.sigmas == pytest.approx(by_pairs.sigmas)
        assert np.array(by_matrix.correlation) == pytest.approx(np.array(by_pairs.correlation))

    def test_every_element_has_the_unit_of_its_block(self) -> None:
        text = [["0"] * 6 for _ in range(6)]
        for i in range(6):
            text[i][i] = "1 m^2" if i < 3 else "1 mm²/s²"
        text[0][3] = text[3][0] = "500 mm^2/s"
        covariance = receiver(text).platforms.receiver.motion_error.covariance
        assert covariance.sigmas == pytest.approx((1, 1, 1, 1e-3, 1e-3, 1e-3))
        assert covariance.correlation[0][3] == pytest.approx(0.5)


@pytest.mark.parametrize("frame", ["track", "look"])
def test_rows_along_the_scene_are_those_of_turned_samples(frame: str) -> None:
    """A million draws in the frame, turned one by one: their spread is known to 0.07 %, five times that is held."""
    correlation = {
        f"velocity.{FRAME_AXES[frame][0]}-velocity.{FRAME_AXES[frame][1]}": 0.9,
        f"velocity.{FRAME_AXES[frame][1]}-velocity.{FRAME_AXES[frame][2]}": 0.3,
    }
    stated = sigmas(correlation, velocity=["5 mm/s", "8 mm/s", "2 mm/s"])
    changes = {ERROR: {"frame": frame, "covariance": stated}, "platforms__receiver__velocity": [-40, 30, 3]}
    found = findings(**changes)
    state = parse_mission(mission_text(**changes)).geometry.receiver
    c = np.diag([25.0, 64.0, 4.0])
    c[0, 1] = c[1, 0] = 0.9 * 40
    c[1, 2] = c[2, 1] = 0.3 * 16
    draws = np.random.default_rng(3).multivariate_normal(np.zeros(3), c * 1e-6, 1_000_000)
    turned = draws @ np.array(state.frame(frame))
    for axis, letter in enumerate("xyz"):
        assert row(found, f"receiver.velocity.{letter}").declared == pytest.approx(turned[:, axis].std(), rel=3.5e-3)
    for axis, name in enumerate(FRAME_AXES[frame]):
        own = row(found, f"receiver.velocity.{name}")
        assert own.declared == pytest.approx(draws[:, axis].std(), rel=3.5e-3)
        assert own.is_independent


class TestAggregates:
    """The receiver flies along (-1, 1): Table II has opposite signs along x and y."""

    @pytest.mark.parametrize("rho", [-1, -0.5, 0, 0.5, 1])
    def test_rss_counts_the_correlation(self, rho: float) -> None:
        pairs = {"velocity.x-velocity.y": rho}
        found = findings(**{ERROR: {"covariance": sigmas(pairs)}, "allocation__combine": "rss"})
        want = PER_UNIT * 5e-3 * math.sqrt(2 - 2 * rho)
        for owner in ("receiver", "mission"):
            assert row(found, f"{owner}.quadratic_phase_error").declared == pytest.approx(want, abs=1e-12)
        assert "gᵀCg" in row(found, "receiver.quadratic_phase_error").notes[0]
        assert row(found, "transmitter.quadratic_phase_error").notes == ()

    def test_without_correlations_it_is_the_two_keys(self) -> None:
        for combine in ("each", "sum", "rss"):
            for frame in ("scene", "track", "look"):
                for model in ("published", "full", "strictest"):
                    changes = {"allocation__combine": combine, "allocation__model": model}
                    plain = {"frame": frame, "position": "1 m", "velocity": "5 mm/s", "acceleration": "10 ug"}
                    tied = {"frame": frame, "covariance": sigmas(), "acceleration": "10 ug"}
                    a, b = (findings(**changes, **{ERROR: error}) for error in (plain, tied))
                    for one, other in zip(a.rows, b.rows, strict=True):
                        assert (one.id, one.status) == (other.id, other.status)
                        assert other.declared == (None if one.declared is None else pytest.approx(one.declared))

    def test_the_frame_does_not_matter(self) -> None:
        """The same covariance stated in three frames, turned by NumPy, has one root-sum-square."""
        geometry = parse_mission(mission_text()).geometry
        rng = np.random.default_rng(1)
        # So small that all effects are proportional to them.
        factor = 1e-3 * np.diag([1, 2, 3, 2e-3, 3e-3, 4e-3]) @ rng.standard_normal((6, 6))
        c = factor @ factor.T
        got = []
        for frame in ("scene", "track", "look"):
            turn = np.kron(np.eye(2), np.array(geometry.receiver.frame(frame)))
            changes = {
                ERROR: {"frame": frame, "covariance": (turn @ c @ turn.T).tolist()},
                "allocation__combine": "rss",
                "allocation__model": "full",
            }
            found = findings(**changes)
            names = ("receiver.quadratic_phase_error", "mission.location_error", "mission.cubic_phase_error")
            got.append([row(found, name).declared for name in (*names, "receiver.velocity.x", "receiver.position.z")])
        assert got[1] == pytest.approx(got[0], rel=1e-9)
        assert got[2] == pytest.approx(got[0], rel=1e-9)

    def test_a_sum_takes_the_marginal_sigmas_and_says_so(self) -> None:
        pairs = {"velocity.x-velocity.y": 1}
        found = findings(**{ERROR: {"covariance": sigmas(pairs)}, "allocation__combine": "sum"})
        aggregate = row(found, "receiver.quadratic_phase_error")
        assert aggregate.declared == pytest.approx(2 * PER_UNIT * 5e-3)
        assert "uses no correlations" in aggregate.notes[0]

    def test_each_warns_that_correlations_have_no_part(self) -> None:
        text = {ERROR: {"covariance": sigmas({"velocity.x-velocity.y": -1})}}
        (warning,) = findings(**text).warnings
        assert "combine: rss" in warning.message
        assert warning.line is not None
        assert findings(**text, allocation__combine="rss").warnings == ()
        assert findings(**{ERROR: {"covariance": sigmas()}}).warnings == ()

    def test_coverage_factor_multiplies_the_sigmas(self) -> None:
        text = {ERROR: {"covariance": sigmas({"velocity.x-velocity.y": -1})}, "allocation__combine": "rss"}
        one, three = findings(**text), findings(**text, allocation__coverage_factor=3)
        for name in ("receiver.velocity.x", "receiver.quadratic_phase_error", "mission.location_error"):
            assert row(three, name).declared == pytest.approx(3 * row(one, name).declared)

    def test_strictest_has_the_row_of_the_stricter_model(self) -> None:
        text = {
            ERROR: {"covariance": sigmas({"velocity.x-velocity.y": 0.8, "position.x-velocity.x": 0.3})},
            "allocation__combine": "rss",
            "requirements": {"location_error": "2 m", "cubic_phase_error": 0.1},
        }
        by = {model: findings(**text, allocation__model=model) for model in ("published", "full", "strictest")}
        for name in ("receiver.quadratic_phase_error", "mission.cubic_phase_error", "mission.location_error"):
            one, two, most = (row(by[model], name).utilization for model in ("published", "full", "strictest"))
            assert most == max(one, two)

    def test_balanced_shares_weigh_with_the_correlation(self) -> None:
        """One sigma of the receiver's phase is 0 with ρ = 1 and the velocities alone: it gets the least share."""
        still = sigmas({"velocity.x-velocity.y": 1}, position=0, velocity=["5 mm/s", "5 mm/s", 0])
        found = findings(
            **{ERROR: {"covariance": still}},
            platforms__transmitter__motion_error={"velocity": "5 mm/s"},
            allocation={"combine": "rss", "split": "balanced"},
        )
        assert found.allocation.qpe.receiver == pytest.approx(0.05)

    def test_zero_sigma_is_declared(self) -> None:
        found = findings(**{ERROR: {"covariance": sigmas(position=0)}})
        assert row(found, "receiver.position.x").declared == 0
        assert row(found, "receiver.position.x").status != "not_declared"


@example(key="velocity.x-velocity.y-velocity.z")
@example(key="-")
@given(key=st.text(st.characters(codec="ascii", exclude_characters="\0"), max_size=30))
def test_any_key_of_a_correlation_is_read_or_refused(key: str) -> None:
    """Never a crash, never silence."""
    try:
        covariance = receiver(sigmas({key: 0.5})).platforms.receiver.motion_error.covariance
    except MissionError:
        return
    assert covariance.has_correlations()
