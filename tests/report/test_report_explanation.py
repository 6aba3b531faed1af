"""`check --explain`: every formula is the derivation's, every number put in gives what the check found."""

import math
import re

import numpy as np
import pytest
import yaml

from bisar_budget.budget.check import check_mission
from bisar_budget.error_kinds.path_kinds import STATE_KINDS
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.report.explain import notation
from bisar_budget.report.explain.explanation import explain
from bisar_budget.theory import render
from tests import families
from tests.conftest import ROOT, TODAY, by_turns, findings, mission_text, name_of
from tests.effects.test_random_errors import MISSION as SENSORS
from tests.effects.test_random_errors import OSCILLATORS
from tests.report.test_text_width import too_long
from tests.verify.test_random_errors import REST

LAMBDA = 299_792_458.0 / 10e9
MISSIONS = [
    *sorted((ROOT / "specs" / "missions").glob("*.yaml")),
    *sorted((ROOT / "tests" / "acceptance" / "good").glob("*.yaml")),
]


def cells(table: str) -> list[list[str]]:
    return [re.split(r" {2,}", line) for line in render.derivation(table, "text").splitlines()]


def test_table_1_is_what_the_derivation_prints() -> None:
    rows = [row for row in cells("I") if row[0].isdigit()]
    printed = {cell for row in rows for cell in row[2:] if cell != "-"}
    ours = {notation.clock_coefficient(order) for order in range(4)}
    for platform in ("transmitter", "receiver"):
        for number, row in enumerate([row for row in rows if f"_{platform[0]}(" in row[1]]):
            kind, axis = STATE_KINDS[number % 3], "xyz"[number // 3]
            texts = notation.motion_coefficients(kind, axis, platform)
            assert [texts.get(order, "-") for order in range(4)] == row[2:6]
            ours |= set(texts.values())
    assert ours == printed


def test_table_2_is_what_the_derivation_prints() -> None:
    printed = [row[2] for row in cells("II") if row[0].isdigit() or row[0] == "-"]
    ours = [
        notation.motion_phase(kind, axis, platform)
        for platform in ("transmitter", "receiver")
        for kind in STATE_KINDS[1:]
        for axis in "xyz"
    ]
    assert [*ours, notation.CLOCK_PHASE] == printed


def explained_full_model(row_id: str) -> str:
    errors = {"platforms__receiver__motion_error": {"frame": "look", "position": [1, 2, 3], "velocity": 0.01}}
    changes = {"allocation__model": "full", "scene__height_error": 3, **errors}
    return explained(row_id, timing_error={"linear": 1e-12, "quadratic": 1e-13}, **changes)


@pytest.mark.parametrize(
    "row_id",
    ["receiver.position.x", "receiver.position.line_of_sight", "receiver.velocity.up", "transmitter.acceleration.z",
     "timing.linear", "timing.quadratic", "mission.terrain"],
)  # fmt: skip
def test_what_is_left_at_the_nodes_is_where_v_is_least(row_id: str) -> None:
    """The text holds times and range errors, from which NumPy makes the same phases; V is least there."""
    text = explained_full_model(row_id)
    listed = text[text.index("ρ there") : text.index("Quadratic phase at the aperture edge, 3/2 of P₂")]
    left = [(float(t), float(m)) for t, m in re.findall(r"(?m)^    ([+-][\d.e+-]+) s: (\S+) m$", listed)]
    assert len(left) >= 6
    times, metres = np.array(left).T
    parts = np.polynomial.legendre.legfit(times / 3.0, metres, len(left) - 1)  # an aperture of 6 s
    phases = {symbol: value for symbol, _, value in sums(text)}
    k, orders = 2 * math.pi / LAMBDA, 2 * np.arange(len(left)) + 1
    assert phases["QPE_full"] == pytest.approx(k * 1.5 * parts[2], rel=1e-4, abs=1e-7)
    mission = parse_mission(mission_text())
    b_squared = (mission.radar.bandwidth / mission.radar.center_frequency) ** 2 / 12
    hidden = b_squared * (parts**2 / orders).sum() + parts[1] ** 2 / 3
    assert phases["hidden_full"] == pytest.approx(k * math.sqrt(45 / 4 * hidden), rel=1e-4, abs=1e-7)
    assert phases["equal_full"] == pytest.approx(math.hypot(phases["QPE_full"], phases["hidden_full"]), rel=1e-5)
    # ⟨∂ρ/∂x, ρ⟩ = 0 in the product of V, with the slopes of the range at the scene centre: the point is 10 m from it.
    slopes = np.zeros((2, times.size))
    for path in (mission.platforms.transmitter.state, mission.platforms.receiver.state):
        track = np.array(path.position) + np.outer(times, path.velocity) + np.outer(times**2 / 2, path.acceleration)
        slopes += (track / np.linalg.norm(track, axis=1)[:, None]).T[:2]
    for slope in slopes:
        gradient = np.polynomial.legendre.legfit(times / 3.0, slope, len(left) - 1)
        product = ((1 + b_squared) * gradient * parts / orders).sum() - gradient[0] * parts[0]
        seen = np.abs((1 + b_squared) * gradient * parts / orders).sum()
        assert abs(product) <= 1e-2 * seen
    assert "The published model, for comparison" in text or row_id == "mission.terrain"


def test_the_published_model_keeps_the_full_one_as_a_comparison() -> None:
    text = explained("receiver.velocity.y")
    assert "for comparison: weights of the fit times residual" in " ".join(text.split())


def test_vibration_and_autofocus_are_what_the_derivation_prints() -> None:
    printed, derived = render.derivation("vibration", "text").split("Vibration, first principles")
    assert [cell for cell in notation.VIBRATION.values() if cell in printed] == list(notation.VIBRATION.values())
    assert notation.FULL_VIBRATION["islr"] in derived
    assert f"G = {notation.AUTOFOCUS_GAIN}" in render.derivation("equations", "text")


def evaluated(text: str) -> float:
    """Do the sum as a reader with a calculator would."""
    text = re.sub(r"\|([^|]*)\|", r"abs(\1)", text).replace("^", "**").replace("π", "pi")
    names = {"pi": math.pi, "sqrt": math.sqrt, "abs": abs, "max": max, "min": min, "log": math.log, "erf": math.erf}
    return float(eval(text, {"__builtins__": {}}, names))


def unbroken(text: str) -> list[str]:
    """Lines with what was broken put together: it goes on three columns deeper."""
    lines: list[str] = []
    for line in text.splitlines():
        indent = [len(one) - len(one.lstrip()) for one in (lines[-1] if lines else "", line)]
        if indent[0] >= 4 and indent[1] == indent[0] + 3:
            lines[-1] += f" {line.lstrip()}"
        else:
            lines.append(line)
    return lines


def sums(text: str) -> list[tuple[str, str, float]]:
    """Every `symbol = numbers = value` of an explanation; the symbol may stand in the line above."""
    found, symbol = [], ""
    for line in unbroken(text):
        left, *parts = line.split(" = ")
        symbol = left.strip() or symbol
        if line.startswith("    ") and len(parts) >= 2:
            found.append((symbol, parts[0].strip().removeprefix("= "), float(parts[1].split(" ")[0])))
    return found


@pytest.mark.parametrize(("path", "model"), by_turns(MISSIONS, ("published", "full", "strictest")), ids=name_of)
def test_every_row_can_be_repeated_by_hand(path, model: str) -> None:
    repeat_by_hand(load_mission(str(path), model))


def repeat_by_hand(mission: Mission) -> None:
    """Six digits are put in, so a sum agrees to 1e-5 of its terms' sizes. No line is longer than a terminal's."""
    found = check_mission(mission, TODAY)
    for row in found.rows:
        results: dict[str, float] = {}
        text = explain(mission, found, row.id)
        assert too_long(text) == []
        for symbol, numbers, value in sums(text):
            sizes = evaluated(re.sub(r"(^|\(|\+ )-", r"\1", numbers).replace(" - ", " + "))
            rounds = 10 / math.log(10) * 5e-6 if "log" in numbers else 0.0  # of the argument, however near 0 dB
            room = 1e-5 * max(abs(sizes), abs(value)) + rounds
            assert abs(evaluated(numbers) - value) <= room, (row.id, symbol, numbers)
            results[symbol] = value
        assert results or row.allowable is None or row.declared is None
        if row.qpe_published_rad is not None and row.unit != "rad" and row.qpe_published_rad:
            assert results["QPE"] == pytest.approx(row.qpe_published_rad, rel=1e-5), row.id
        if row.qpe_full_rad and row.unit != "rad":
            # Double precision holds the ranges of a low satellite to 1e-10 m, those of a geostationary one to 4e-9 m.
            wave, geometry = 2 * math.pi / mission.radar.wavelength, mission.geometry
            rounding = 2**-51 * wave * (geometry.transmitter.slant_range + geometry.receiver.slant_range)
            floor = max(2e-7, rounding)
            assert abs(results["QPE_full"]) == pytest.approx(abs(row.qpe_full_rad), rel=1e-5, abs=floor), row.id
            if "equal_full" in results and "larger" not in text:
                assert results["equal_full"] == pytest.approx(row.equal_loss_qpe_rad, rel=1e-5, abs=floor), row.id
            if "rest_full" in results:
                # That of the row is a difference of mean squares, whose root holds 1e-8 of what is left.
                room = 1e-8 * wave * results["ρ_rms"] + floor
                assert results["rest_full"] == pytest.approx(row.rest_rad, rel=1e-5, abs=room), row.id
        if row.utilization is not None and row.allowable is not None:
            assert results["utilization"] == pytest.approx(row.utilization, rel=1e-5, abs=1e-12), row.id
        if row.allowable is not None and row.unit not in ("rad",) and row.metric != "location_error":
            assert results["allowable"] == pytest.approx(row.allowable, rel=1e-5), row.id


SURE = """
requirements:
  quadratic_phase_error: { limit: 45 deg, confidence: 90 % }
  cubic_phase_error: { limit: 30 deg, confidence: 99.7 % }
  location_error: { limit: 5 m, confidence: 95 % }
"""
BIASED = {
    "platforms__transmitter__motion_error": {
        "position": {"sigma": ["10 cm", "10 cm", "20 cm"], "bias": [0, 0, "5 cm"]},
        "velocity": {"sigma": "5 mm/s", "bias": ["-2 mm/s", 0, 0]},
        "distribution": {"position": "normal", "velocity": "uniform"},
    },
    "platforms__receiver__motion_error": {
        "position": {"sigma": "50 cm", "bias": ["30 cm", "-10 cm", 0]},
        "velocity": {"bias": ["2 mm/s", 0, "1 mm/s"]},
        "acceleration": {"sigma": "20 um/s^2", "bias": "5 um/s^2"},
        "distribution": {"position": "bound", "acceleration": "normal"},
    },
    "timing_error": {"constant": {"sigma": "1 ns", "bias": "2 ns"}, "linear": 1e-12},
}


@pytest.mark.parametrize("model", ["published", "full"])
@pytest.mark.parametrize("rule", ["rss", "sum", "each"])
@pytest.mark.parametrize("asks", [True, False], ids=["sure", "one sigma"])
def test_biases_and_confidences_can_be_repeated_by_hand(model: str, rule: str, asks: bool) -> None:
    allocation = {"model": model, "combine": rule, **({} if asks else {"coverage_factor": 2})}
    text = mission_text(**BIASED, allocation=allocation, **({"autofocus__n_pull": 2} if rule == "rss" else {}))
    mission = parse_mission(text + SURE if asks else text)
    repeat_by_hand(mission)
    found = check_mission(mission, TODAY)
    for row in found.rows:
        results = dict(re.findall(r"(?m)^    (\w+) = (\S+)", explain(mission, found, row.id)))
        if row.id in ("mission.cubic_phase_error", "mission.location_error") and row.declared is not None:
            steps = {symbol: value for symbol, _, value in sums(explain(mission, found, row.id))}
            declared = steps.get("combined") or float(results["combined"])
            assert declared == pytest.approx(row.declared, rel=1e-5)
        if row.bias is not None:
            assert float(results["bias"]) == pytest.approx(row.bias, rel=1e-5)


@pytest.mark.parametrize("model", ["published", "full"])
@pytest.mark.parametrize("rule", ["rss", "sum", "each"])
def test_quantiles_of_sensors_can_be_repeated_by_hand(model: str, rule: str) -> None:
    allocation = f"allocation: {{model: {model}, combine: {rule}}}\n"
    repeat_by_hand(parse_mission(SENSORS.rstrip() + OSCILLATORS + SURE + "  islr: -20 dB\n" + allocation))


BIASED_AIR = {
    "both legs": "zenith_delay: { sigma: 5 cm, bias: -10 cm }",
    "one value per leg": (
        "transmitter: { zenith_delay: { sigma: 5 cm, bias: 10 cm } }\n"
        "  receiver: { zenith_delay: { sigma: 5 cm, bias: -2 cm } }"
    ),
    "it changes": "zenith_delay: { sigma: 5 cm, bias: 10 cm }\n  correlation_time: 20 s",
    "beyond the limit": "zenith_delay: { sigma: 5 cm, bias: 10 m }",
}
BIASED_PHASES = [
    {"name": "filter", "quadratic_phase_error": {"sigma": "3 deg", "bias": "-2 deg"}},
    {"name": "clock board", "cubic_phase_error": {"sigma": "1 deg", "bias": "2 deg"}},
]


def repeat_biases(text: str) -> None:
    """Repeat every row by hand; each row with a bias states it."""
    mission = parse_mission(text)
    repeat_by_hand(mission)
    found = check_mission(mission, TODAY)
    biased = [row for row in found.rows if row.bias is not None]
    assert biased
    for row in biased:
        results = dict(re.findall(r"(?m)^    (\w+) = (\S+)", explain(mission, found, row.id)))
        assert float(results["bias"]) == pytest.approx(row.bias, rel=1e-5), row.id


@pytest.mark.parametrize("model", ["published", "full"])
@pytest.mark.parametrize("air", BIASED_AIR)
@pytest.mark.parametrize("asks", [True, False], ids=["sure", "one sigma"])
def test_biases_of_random_errors_can_be_repeated_by_hand(model: str, air: str, asks: bool) -> None:
    """A delay of the air has a bias beside its random part, and its size at a limit follows from both."""
    rule = ["rss", "sum", "each"][list(BIASED_AIR).index(air) % 3]
    allocation = {"model": model, "combine": rule, **({} if asks else {"coverage_factor": 2})}
    text = mission_text(allocation=allocation, **({"autofocus__n_pull": 2} if air == "both legs" else {}))
    text += f"propagation:\n  {BIASED_AIR[air]}\n"
    repeat_biases(text + (SURE + "  islr: -20 dB\n" if asks else ""))


@pytest.mark.parametrize("asks", [True, False], ids=["sure", "one sigma"])
def test_biases_of_stated_phases_can_be_repeated_by_hand(asks: bool) -> None:
    text = mission_text(other_errors=BIASED_PHASES, **BIASED)
    repeat_biases(text + SURE if asks else text)


def test_a_location_lists_the_bias_of_each_error() -> None:
    """Errors that another row includes are not counted, nor are their biases."""
    text = mission_text(**BIASED, allocation={"model": "full", "combine": "rss"})
    mission = parse_mission(f"{text}propagation: {{zenith_delay: {{sigma: 5 cm, bias: 10 cm}}}}\n{SURE}")
    found = check_mission(mission, TODAY)
    lines = unbroken(explain(mission, found, "mission.location_error"))
    listed = {line.split(":")[0].removeprefix("    bias of ") for line in lines if line.startswith("    bias of ")}
    counted = {error.id for error in found.analysed().random if error.counted_in}
    assert listed == {row.id for row in found.rows if row.bias is not None} - counted
    assert len(listed) > 5


@pytest.mark.parametrize("confidence", ["50 %", "95 %"])
@pytest.mark.parametrize(("family", "seed"), [("drones", 36), ("aircraft", 3)])
def test_ends_of_images_with_a_confidence_can_be_repeated_by_hand(family: str, seed: int, confidence: str) -> None:
    """Where the image ends, it allows the declared size whose quantile is the size at the end."""
    tree = yaml.safe_load(families.mission_text(family, seed))
    tree["allocation"].pop("coverage_factor", None)  # refused beside a confidence
    tree["allocation"]["model"] = "full"
    limit = tree["requirements"]["quadratic_phase_error"]
    tree["requirements"] = {
        "quadratic_phase_error": {"limit": limit, "confidence": confidence},
        "location_error": {"limit": "100 km", "confidence": "99.7 %"},
    }
    mission = parse_mission(yaml.safe_dump(tree, allow_unicode=True))
    found = check_mission(mission, TODAY)
    assert any("end_of_image" in explain(mission, found, row.id) for row in found.rows)
    repeat_by_hand(mission)


@pytest.mark.parametrize("needs", ["", "pslr: -5 dB", "islr: -5 dB, cubic_phase_error: 30 deg"])
def test_a_tone_below_three_cycles_can_be_repeated_by_hand(needs: str) -> None:
    """Vibration, spur and shaken oscillator at 1.5 and 1.8 cycles per aperture, held by their phases."""
    text = mission_text(
        platforms__receiver__motion_error={"vibration": {"sinusoidal": [{"amplitude": "0.5 mg", "frequency": 0.25}]}},
        platforms__receiver__oscillator={
            "frequency": "10 MHz",
            "power_law": {"h0": "1e-30"},
            "spurs": {"0.3 Hz": "-80 dBc"},
            "acceleration_sensitivity": "1e-8 /g",
        },
        allocation={"model": "strictest"},
    )
    mission = parse_mission(f"{text}requirements: {{{needs}}}\n" if needs else text)
    repeat_by_hand(mission)
    found = check_mission(mission, TODAY)
    vibration = next(row for row in found.rows if row.id == "receiver.vibration.sinusoidal.0")
    assert vibration.binding_requirement == ("cubic_phase_error" if "cubic" in needs else "quadratic_phase_error")


@pytest.mark.parametrize("model", ["published", "full"])
@pytest.mark.parametrize("factor", [1, 2])
def test_tones_and_sensors_under_a_link_can_be_repeated_by_hand(model: str, factor: int) -> None:
    """A direct path changes what is left of a sensor's noise, and exchanged pulses what is left of a tone."""
    rest = REST.replace("model: full", f"model: {model}").replace("coverage_factor: 2", f"coverage_factor: {factor}")
    tones = "      spurs: {2 Hz: -90 dBc, 130 Hz: -120 dBc}\n"
    exchanged = "synchronization: {interval: 10 ms, error: 0.1 deg}\n"
    heard = "synchronization: {method: direct_path, error: 0.1 deg}\n"
    pslr = rest.replace("islr: -20 dB", "islr: -20 dB, pslr: -30 dB")
    repeat_by_hand(parse_mission(SENSORS.rstrip() + OSCILLATORS + tones + exchanged + pslr))
    mission = parse_mission(SENSORS.rstrip() + OSCILLATORS + heard + rest)
    repeat_by_hand(mission)
    found = check_mission(mission, TODAY)
    for error in found.analysed().random:
        if error.declared and error.published.spread != error.full.spread:
            (mine, other) = ("left_full", "left") if model == "full" else ("left", "left_full")
            results = {symbol: value for symbol, _, value in sums(explain(mission, found, error.id))}
            other_model = "published" if model == "full" else "full"
            assert results[mine] == pytest.approx(error.effect(model).spread * error.declared, rel=1e-5)
            assert results[other] == pytest.approx(error.effect(other_model).spread * error.declared, rel=1e-5)


def explained(row_id: str, **changes) -> str:
    mission = parse_mission(mission_text(**changes), "m.yaml")
    return explain(mission, check_mission(mission, TODAY), row_id)


def test_starts_at_the_line_of_the_file() -> None:
    changes = {"platforms__transmitter__motion_error": {"acceleration": "500 ug", "source": "data sheet"}}
    text = explained("transmitter.acceleration.x", **changes)
    line = next(n for n, line in enumerate(mission_text(**changes).splitlines(), 1) if "500 ug" in line)
    assert f"m.yaml:{line}:21" in text
    assert "platforms.transmitter.motion_error.acceleration: 500 ug" in text
    assert "data sheet" in text


def test_coverage_factor_and_share_and_gain_stand_in_the_chain() -> None:
    text = explained(
        "timing.quadratic",
        timing_error__quadratic=1e-13,
        allocation={
            "coverage_factor": 3,
            "split": {"transmitter": 0.5, "receiver": 0.2, "clock": 0.2, "reserve": 0.1},
        },
        autofocus__n_pull=2,
    )
    assert "= 3*|1e-13| = 3e-13 1/s" in text
    assert "= 0.785398*0.2*8 = 1.25664 rad" in text
    assert "the clock’s share" in text


def test_a_frame_is_turned_before_the_eyes_of_the_reader() -> None:
    error = {"frame": "look", "velocity": ["1 mm/s", "2 mm/s", "3 mm/s"], "distribution": "bound"}
    text = explained("receiver.velocity.x", platforms__receiver__motion_error=error)
    assert "from the look frame (line_of_sight, cross, up): bounds add as magnitudes" in text


def test_an_undeclared_row_says_so_and_has_its_allowable() -> None:
    text = explained("transmitter.velocity.y")
    assert text.startswith("not decl transmitter.velocity.y of base")
    assert "no platforms.transmitter.motion_error.velocity (the" in text
    assert "by_QPE = limit/(QPE/unit)" in text


def test_names_do_nothing_to_a_terminal() -> None:
    text = explained("timing.linear", name="a\u200fb")
    assert "\u200f" not in text


class TestCommand:
    def test_each_mission_that_has_the_row(self, run, tmp_path) -> None:
        (tmp_path / "a.yaml").write_text(mission_text(name="first", autofocus__n_pull=2))
        (tmp_path / "b.yaml").write_text(mission_text(name="second"))
        both = run("check", tmp_path / "a.yaml", tmp_path / "b.yaml", "--explain", "timing.linear")
        assert both.exit_code == 0
        assert "of first" in both.stdout
        assert "of second" in both.stdout
        one = run("check", tmp_path / "a.yaml", tmp_path / "b.yaml", "--explain", "mission.autofocus_pull_in")
        assert "of second" not in one.stdout

    @pytest.mark.parametrize(
        ("row_id", "hint"),
        [
            ("receiver.velocty.x", "Did you mean 'receiver.velocity.x'?"),
            ("%", "no row or requirement has this id; `bisar-budget check - --all` lists them.\n"),
        ],
    )
    def test_an_unknown_id_is_2_with_a_hint(self, run, row_id, hint) -> None:
        result = run("check", "-", "--explain", row_id, input=mission_text())
        assert result.exit_code == 2
        assert hint in result.stderr

    def test_formats_are_refused(self, run) -> None:
        result = run("check", "-", "--explain", "timing.linear", "--format", "json", input=mission_text())
        assert result.exit_code == 2
        assert "--explain writes text" in result.stderr

    def test_output_file(self, run, tmp_path) -> None:
        run("check", "-", "--explain", "timing.linear", "-o", tmp_path / "x.txt", input=mission_text())
        assert "Table I row 1" in (tmp_path / "x.txt").read_text(encoding="utf-8")


def test_a_vibration_along_three_axes_is_projected_before_the_eyes_of_the_reader() -> None:
    """Its 198 µm stood there without the sum that they come from."""
    vibration = {"sinusoidal": [{"amplitude": ["200 um", "50 um", "10 um"], "frequency": "15 Hz"}]}
    vibration["wideband"] = {"rms": ["10 um", "10 um", "5 um"]}
    changes = {"platforms__transmitter__motion_error": {"vibration": vibration}, "allocation__model": "full"}
    for row in ("transmitter.vibration.sinusoidal.0", "transmitter.vibration.wideband"):
        text = explained(row, **changes)
        ((numbers, value),) = [(numbers, value) for symbol, numbers, value in sums(text) if symbol == "declared"]
        assert evaluated(numbers) == pytest.approx(value, rel=1e-5)
        assert "Along the line of sight" in text


def test_the_phase_of_the_echoes_is_that_of_both_shares() -> None:
    """Not 2√PSLR where shares of power leave a reserve."""
    changes = {
        "platforms__transmitter__motion_error": {
            "vibration": {"sinusoidal": [{"amplitude": "20 um", "frequency": "15 Hz"}]}
        },
        "allocation__split": {"transmitter": 0.4, "receiver": 0.3, "reserve": 0.3},
        "requirements__pslr": "-30 dB",
    }
    text = explained("transmitter.vibration.sinusoidal.0", **changes)
    levels = {symbol: value for symbol, _, value in sums(text)}
    assert levels["l"] == pytest.approx(math.sqrt(1e-3 * 0.7), rel=1e-5)
    (phase,) = re.findall(r"φ = (\S+) rad", text)
    assert float(phase) == pytest.approx(2 * levels["l"], rel=1e-3)  # J₁/J₀ is φ/2·(1 + φ²/8 + …)
    assert "2*sqrt(PSLR)" not in text


@pytest.mark.parametrize("model", ["published", "full"])
def test_both_models_start_from_the_same_sign(model: str) -> None:
    """A negative error was put into Table I as a positive one, and into the full model as it is."""
    changes = {"platforms__receiver__motion_error": {"position": "-2 m"}, "allocation__model": model}
    text = explained("receiver.position.x", **changes)
    (value,) = [value for symbol, _, value in sums(text) if symbol == "β̃_0"]
    assert value > 0  # the receiver is east of the scene: measured too far west, its range is measured too short
    if model == "full":
        east, north = (float(part) for part in re.findall(r"[x\u0177ŷ]\u0302? = (\S+) m (?:east|north)", text))
        assert east < 0  # and so is the image too far west
        assert north


def test_what_is_left_of_rounding_is_not_listed() -> None:
    """`common.position.x  2.08167e-17 rad` is no difference of phases."""
    changes = {
        "common_motion_error": {"position": "3 m", "velocity": "1 mm/s"},
        "scene": {"radius": "800 m"},
        "allocation__model": "full",
        "allocation__combine": "rss",
    }
    text = explained("mission.spatial_variance", **changes)
    assert "common.velocity.x" in text
    assert not re.search(r"e-1[4-9]", text)
    assert not re.search(r"e-1[4-9] m$", explained("common.position.y", **changes), re.MULTILINE)


@pytest.mark.parametrize("rule", ["each", "rss", "sum"])
def test_errors_at_random_are_among_what_differs_at_the_edge(rule: str) -> None:
    """By their sigmas, which combine with the others to the very number of the row."""
    changes = {
        "platforms__receiver__motion_error": {
            "imu": {"accelerometer_bias": "10 mm/s^2"},
            "random": [{"name": "gnss", "sigma": "2 cm", "correlation_time": "5 s"}],
        },
        "scene": {"radius": "800 m"},
        "allocation__model": "full",
        "allocation__combine": rule,
    }
    text = explained("mission.spatial_variance", **changes)
    sizes = {name: abs(float(size)) for name, size in re.findall(r"^ +([\w.]+) +(\S+) rad$", text, re.MULTILINE)}
    assert {"receiver.imu.accelerometer_bias", "receiver.random.gnss"} <= sizes.keys()
    together = {"each": max, "sum": math.fsum, "rss": lambda parts: math.hypot(*parts)}[rule](sizes.values())
    (row,) = (one for one in findings(**changes).rows if one.id == "mission.spatial_variance")
    assert row.declared == pytest.approx(together, rel=1e-4)


def test_a_sensitivity_per_g_is_converted_where_si_units_begin() -> None:
    """g is 9.80665 m/s²: 1 /g is 0.101972 s²/m, and 3e-10 /g is 3.05915e-11 s²/m."""
    mission = load_mission(str(ROOT / "specs" / "missions" / "uav_vibrating_ocxo.yaml"))
    text = explain(mission, check_mission(mission, TODAY), "receiver.oscillator.acceleration")
    assert "acceleration_sensitivity: 3e-10 /g" in text
    assert "Per g is per 9.80665 m/s²: 1 /g = 0.101972 s²/m" in text
    assert "3.05915e-11 s²/m" in text
