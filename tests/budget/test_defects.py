"""Defects that were found and mended, one named test each."""

import csv
import io
import json
import math
import os
import signal
import stat
import subprocess
import sys

import pytest

from bisar_budget.budget.check import check_mission
from bisar_budget.faults import MissionError, SetValue
from bisar_budget.findings.mission import Report
from bisar_budget.geometry import BistaticGeometry, PlatformState
from bisar_budget.mission.load import parse_mission
from bisar_budget.report import Style, render
from tests.conftest import ROOT, TODAY, findings, heed_signals, mission_text, row
from tests.families import mission_text as of_family

COMMAND = [sys.executable, "-m", "bisar_budget"]
ERROR = "platforms__transmitter__motion_error"
needs_posix = pytest.mark.skipif(os.name != "posix", reason="POSIX files")


@pytest.fixture
def mission(tmp_path):
    path = tmp_path / "m.yaml"
    path.write_text(mission_text())
    return path


def faults(text: str) -> list[str]:
    with pytest.raises(MissionError) as error:
        parse_mission(text, "m.yaml")
    return error.value.lines()


@needs_posix
class TestOutputs:
    @pytest.mark.parametrize("option", ["-o", "--report"])
    def test_a_named_pipe_is_refused_and_stays_one(self, run, mission, tmp_path, option) -> None:
        """Without a reader at its other end the command waited for ever."""
        fifo = tmp_path / "pipe.txt"
        os.mkfifo(fifo)
        done = run("check", mission, "-q", option, fifo)
        assert done.exit_code == 2
        assert f"cannot write {fifo}: a named pipe; accepted: a regular file, or - for standard output" in done.stderr
        assert stat.S_ISFIFO(fifo.stat().st_mode)

    def test_a_device_is_refused(self, run, mission) -> None:
        done = run("check", mission, "-q", "-o", "/dev/zero")
        assert done.exit_code == 2
        assert "cannot write /dev/zero: a device" in done.stderr

    def test_nothing_and_an_open_stream_are_written_to(self, run, mission) -> None:
        assert run("check", mission, "-q", "-o", os.devnull).exit_code == 1

    @pytest.mark.parametrize("command", [("check",), ("diff",), ("allocate",), ("sweep", "--cases")])
    def test_a_named_pipe_is_not_read(self, run, mission, tmp_path, command) -> None:
        fifo = tmp_path / "pipe.yaml"
        os.mkfifo(fifo)
        before = [mission] if command[0] in ("diff", "sweep") else []
        done = run(command[0], *before, *command[1:], fifo)
        assert done.exit_code == 2
        assert "cannot be read: a named pipe; accepted: a regular file" in " ".join(
            (done.stdout + done.stderr).split()
        )

    def test_a_link_keeps_pointing_where_it_does(self, run, mission, tmp_path) -> None:
        real, link = tmp_path / "real.txt", tmp_path / "link.txt"
        real.write_text("old")
        link.symlink_to(real)
        run("check", mission, "-q", "-o", link)
        assert link.is_symlink()
        assert "NOT EVAL" in real.read_text()

    def test_a_dash_is_standard_output(self, run, mission, monkeypatch, tmp_path) -> None:
        monkeypatch.chdir(tmp_path)
        assert "NOT EVAL" in run("check", mission, "-q", "-o", "-").stdout
        assert not (tmp_path / "-").exists()

    @pytest.mark.parametrize("option", ["-o", "--report"])
    def test_a_report_never_replaces_its_mission(self, run, tmp_path, option) -> None:
        path = tmp_path / "m.csv"
        path.write_text(mission_text())
        result = run("check", path, option, path)
        assert result.exit_code == 2
        assert "a result would replace it" in result.stderr
        assert path.read_text() == mission_text()

    def test_a_name_that_is_not_utf_8_leaves_no_temporary_file(self, mission, tmp_path) -> None:
        odd = os.fsencode(tmp_path) + b"/n\xff.yaml"
        os.rename(mission, odd)
        for format_name in ("text", "csv", "json"):
            target = tmp_path / f"out.{format_name}"
            done = subprocess.run(
                [*COMMAND, "check", odd, "--format", format_name, "-o", target], capture_output=True
            )
            assert done.returncode == 1, done.stderr
            assert target.read_text()
        assert sorted(p.name for p in tmp_path.iterdir() if p.name.startswith(".")) == []


@needs_posix
class TestStreams:
    def test_a_closed_standard_error_does_not_turn_2_into_1(self, tmp_path) -> None:
        for arguments in (["check", str(tmp_path / "none.yaml")], ["check", "x", "--report", "x.foo"]):
            reader, writer = os.pipe()
            os.close(reader)
            done = subprocess.run([*COMMAND, *arguments], stdout=subprocess.DEVNULL, stderr=writer)
            os.close(writer)
            assert done.returncode == 2

    def test_an_interrupt_is_not_a_broken_requirement(self) -> None:
        process = subprocess.Popen(
            [*COMMAND, "check", "-"],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            preexec_fn=heed_signals,
        )
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(1.5)  # it has started and waits for the mission
        process.send_signal(signal.SIGINT)
        assert process.wait(20) not in (0, 1, 2, 3)
        process.stdin.close()

    @pytest.mark.parametrize("redirection", ["<&-", ">&-", ">/dev/full"])
    def test_streams_that_cannot_be_used_are_the_users_to_mend(self, mission, redirection) -> None:
        if "full" in redirection and not os.path.exists("/dev/full"):
            pytest.skip("no /dev/full here")
        file = "-" if redirection == "<&-" else str(mission)
        command = f"exec {sys.executable} -m bisar_budget check {file} {redirection}"
        done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, cwd=ROOT)
        assert done.returncode == 2
        assert "Traceback" not in done.stderr
        assert "standard" in done.stderr or "standard" in done.stdout

    def test_quiet_on_a_terminal_still_says_the_faults(self, tmp_path) -> None:
        import pty

        path = tmp_path / "bad.yaml"
        path.write_text(mission_text().replace("10 GHz", "-10 GHz"))
        leader, follower = pty.openpty()
        subprocess.run([*COMMAND, "check", "-q", path], stdout=follower, stderr=follower, cwd=ROOT)
        os.close(follower)
        assert b"must be greater than 0 Hz" in os.read(leader, 65536)
        os.close(leader)


@needs_posix
@pytest.mark.parametrize("name", ["a\x1b[31mred\x1b]0;t\x07.yaml", "two\nlines.yaml", "\u202egpj.yaml"])
def test_file_names_neither_steer_a_terminal_nor_break_a_line(run, tmp_path, name) -> None:
    good, bad = tmp_path / name, tmp_path / f"bad {name}"
    good.write_text(mission_text(**{f"{ERROR}__velocity": "5 m/s"}))
    bad.write_text("name: x\n")
    for path in (good, bad):
        result = run("check", path)
        for text in (result.stdout, result.stderr):
            assert not set(text) & set("\x1b\x07\u202e")
        assert name.split("\n")[-1] not in result.stdout.splitlines()


class TestFaults:
    def test_platforms_that_hardly_move_give_no_infinite_number(self) -> None:
        text = mission_text(
            platforms__transmitter__velocity=[0, 1e-306, 0],
            platforms__receiver__velocity=[0, 0, 0],
            **{f"{ERROR}__velocity": 1},
        )
        assert "both platforms are still" in faults(text)[0]

    def test_a_fault_elsewhere_does_not_hide_a_degenerate_geometry(self) -> None:
        text = mission_text(requirements__pslr="3 dBi", platforms__receiver__velocity=[0, 0, 0])
        text = text.replace("150 m/s", "0 m/s")
        assert any("both platforms are still" in line for line in faults(text))
        assert any("dBi" in line for line in faults(text))

    def test_an_unknown_key_does_not_hide_a_platform_below_the_ground(self) -> None:
        text = mission_text(platforms__receiver__position=["6 km", "6 km", "-2 km"], platforms__receiver__velocty=1)
        assert any("below the ground" in line for line in faults(text))
        assert any("velocty" in line for line in faults(text))

    def test_faults_inside_a_section_written_twice_stay_where_they_are(self) -> None:
        text = mission_text(radar__center_frequency="-1 GHz") + "radar:\n  center_frequency: 10 GHz\n"
        assert any(line.startswith("m.yaml:4:21: radar.center_frequency: must be greater") for line in faults(text))

    @pytest.mark.parametrize("text", ["6 m in", "5 m m"])
    def test_a_space_inside_a_unit_is_not_closed_up(self, text: str) -> None:
        assert "unknown unit" in faults(mission_text(collection__aperture_time=text))[0]

    def test_digits_of_other_scripts_are_no_numbers(self) -> None:
        assert faults(mission_text(collection__aperture_time="٥"))

    @pytest.mark.parametrize("text", ["radar:\n", "platforms:\n  transmitter:\n    position: [1, null, 3]\n", "~\n"])
    def test_a_missing_value_promises_no_default(self, text: str) -> None:
        assert not any("default" in line for line in faults(text))


class TestModelOption:
    @pytest.mark.parametrize("in_file", [{}, {"allocation__model": "strictest"}])
    def test_overrides_the_file_also_where_that_has_no_allocation(self, run, in_file) -> None:
        for model in ("published", "full"):
            result = run("check", "-", "--model", model, "--format", "json", input=mission_text(**in_file))
            assert result.exit_code == 1  # nothing is declared
            assert json.loads(result.stdout)["missions"][0]["model"] == model


class TestInit:
    @pytest.mark.parametrize("name", ["🛰 mission", "ü – \\ \" '", "a: b # c", "<&>"])
    def test_any_printable_name_gives_a_mission_that_loads(self, run, tmp_path, name) -> None:
        path = tmp_path / "m.yaml"
        assert run("init", path, "--name", name).exit_code == 0
        result = run("check", path, "--format", "json")
        assert json.loads(result.stdout)["missions"][0]["name"] == name

    @pytest.mark.parametrize("name", ["", " ", "two\nlines", "\x1b[31m", "x" * 501])
    def test_a_name_that_check_would_refuse_is_refused(self, run, tmp_path, name) -> None:
        result = run("init", tmp_path / "m.yaml", "--name", name)
        assert result.exit_code == 2
        assert not (tmp_path / "m.yaml").exists()


class TestRows:
    def test_reason_of_no_limit_is_given_under_sum_too(self) -> None:
        found = findings(allocation__combine="sum", **{f"{ERROR}__position": 1})
        assert "moves the image" in row(found, "transmitter.position.x").reason

    @pytest.mark.parametrize("rule", ["sum", "rss"])
    @pytest.mark.parametrize("frame", ["scene", "track", "look"])
    def test_aggregates_follow_from_the_rows_marked_independent(self, rule, frame) -> None:
        error = {"frame": frame, "velocity": [0.01, 0.02, 0.005], "acceleration": [1e-4, 2e-4, 1e-4]}
        found = findings(allocation__combine=rule, platforms__receiver__motion_error=error)
        phases = [r.qpe_published_rad for r in found.rows if r.is_independent and r.id.startswith("receiver.v")]
        phases += [r.qpe_published_rad for r in found.rows if r.is_independent and r.id.startswith("receiver.a")]
        phases = [phase for phase in phases if phase is not None]
        want = math.fsum(phases) if rule == "sum" else math.hypot(*phases)
        assert row(found, "receiver.quadratic_phase_error").declared == pytest.approx(want)

    @pytest.mark.parametrize(
        ("rule", "combine"), [("each", max), ("sum", math.fsum), ("rss", lambda x: math.hypot(*x))]
    )
    def test_cubic_phase_follows_the_rule(self, rule, combine) -> None:
        found = findings(
            allocation__combine=rule, **{f"{ERROR}__acceleration": [0, 0.01, 0], "timing_error__cubic": 1e-14}
        )
        R = math.hypot(30e3, 6e3)
        parts = [2 * math.pi / 0.0299792458 * 0.01 * 150 / (2 * R) * 27, 2 * math.pi * 10e9 * 1e-14 * 27]
        assert row(found, "mission.cubic_phase_error").declared == pytest.approx(combine(parts))

    def test_each_looks_at_the_errors_as_stated_alone(self) -> None:
        """North gets more of both bounds than either alone, but nobody stated an error along it."""
        error = {"frame": "look", "position": [1, 1, 1], "distribution": "bound"}
        found = findings(requirements__location_error=50, platforms__receiver__motion_error=error)
        moved = {
            r.id: math.hypot(*r.displacement_m)
            for r in found.rows
            if r.displacement_m is not None and r.id.startswith("receiver.position")
        }
        assert max(moved, key=moved.get) in ("receiver.position.x", "receiver.position.y")
        stated = max(moved[f"receiver.position.{axis}"] for axis in ("line_of_sight", "cross", "up"))
        assert row(found, "mission.location_error").declared == pytest.approx(stated)

    def test_the_clock_weighs_in_the_balance_with_the_receiver(self) -> None:
        found = findings(
            allocation__split="balanced", timing_error__quadratic=1e-13, **{f"{ERROR}__velocity": [0, 0.01, 0]}
        )
        velocity = math.pi * 0.01 * 150 * 36 / (2 * 0.0299792458 * math.hypot(30e3, 6e3))
        clock = math.pi * 10e9 * 1e-13 * 36 / 2
        assert found.allocation.qpe.transmitter == pytest.approx(velocity / (velocity + clock))

    def test_lines_of_the_aggregates(self) -> None:
        found = findings(autofocus__n_pull=2, requirements__location_error=5)
        lines = mission_text(autofocus__n_pull=2, requirements__location_error=5).splitlines()
        assert "n_pull" in lines[row(found, "mission.autofocus_pull_in").line - 1]
        assert "location_error" in lines[row(found, "mission.location_error").line - 1]

    def test_a_waiver_can_name_an_id_with_brackets(self) -> None:
        found = findings(
            other_errors=[{"name": "a[1]", "quadratic_phase_error": 2}],
            waivers=[{"id": "other.a[1]", "until": "2030-01-01", "reason": "x"}],
        )
        assert row(found, "other.a[1]").status == "waived"
        assert not found.warnings


class TestReports:
    def test_json_gives_the_clock_its_own_share(self) -> None:
        shares = {"transmitter": 0.5, "receiver": 0.3, "clock": 0.15, "reserve": 0.05}
        document = json.loads(render("json", Report("", (findings(allocation__split=shares),)), Style()))
        budget = document["missions"][0]["budget"]["qpe_rad"]
        assert budget["clock"] == pytest.approx(0.15 * math.pi / 4)
        assert budget["reserve"] == pytest.approx(0.05 * math.pi / 4)

    def test_coverage_factor_is_said(self) -> None:
        report = Report("", (findings(allocation__coverage_factor=2),))
        assert "2 times the file's value" in render("text", report, Style())
        assert json.loads(render("json", report, Style()))["missions"][0]["coverage_factor"] == 2

    def test_standard_input_is_a_plain_dash_in_csv(self, run) -> None:
        text = run("check", "-", "--format", "csv", input=mission_text()).stdout
        assert next(csv.DictReader(io.StringIO(text)))["file"] == "-"


def test_cross_range_resolution_of_gradients_that_are_not_at_right_angles() -> None:
    """Independent: the distance along the line of constant range that turns the phase by one cycle over T."""
    pair = BistaticGeometry(
        transmitter=PlatformState(position=(20e3, 3e3, 5e3), velocity=(-80.0, 120.0, 0.0)),
        receiver=PlatformState(position=(4e3, 7e3, 2e3), velocity=(20.0, 30.0, 0.0)),
    )

    def range_sum(x, y, tau):
        return sum(
            math.dist([p + v * tau for p, v in zip(s.position, s.velocity, strict=True)], (x, y, 0.0))
            for s in (pair.transmitter, pair.receiver)
        )

    across = pair.look_azimuth + math.pi / 2
    step, T = 1.0, 0.2  # short, so that the gradients stand still
    turned = [
        range_sum(step * math.cos(across), step * math.sin(across), t) - range_sum(0, 0, t) for t in (-T / 2, T / 2)
    ]
    cycles_per_metre = abs(turned[1] - turned[0]) / 0.03 / step
    assert pair.cross_range_resolution(0.03, T) == pytest.approx(1 / cycles_per_metre, rel=2e-3)


def test_errors_of_a_covariance_that_none_is_large_beside_have_a_scene_edge() -> None:
    """The climb along the scene's edge wrote into numbers that all circles share, and the check ended in a crash."""
    with_covariance = SetValue(
        "platforms.receiver.motion_error",
        "{covariance: {position: [1 m, 1 m, 2 m], velocity: 5 mm/s, correlation: {position.x-velocity.x: 0.6}}}",
    )
    mission = parse_mission(of_family("satellite_aircraft", 96), "m.yaml", changes=[with_covariance])
    assert check_mission(mission, TODAY).status == "pass"
