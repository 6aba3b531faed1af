"""What is read of CPHD, CRSD and SICD, held to the standards' own samples and to sarkit's reference geometry."""

import copy
import math
import os

import numpy as np
import pytest
import yaml

from tests.formats import flown
from tests.formats.flown import SAMPLES, element, sample, values, written

pytest.importorskip("sarkit.cphd")

from bisar_budget.formats.collected import mission_text, mission_tree
from bisar_budget.formats.containers import FormatError
from bisar_budget.formats.importing import import_collection
from bisar_budget.mission.load import parse_mission

BISTATIC = "example-cphd-1.0.1.xml"


@pytest.fixture(scope="module")
def bistatic(tmp_path_factory):
    return written(tmp_path_factory.mktemp("cphd") / "bistatic.cphd", sample(BISTATIC))


def vector(entry):
    return np.array([float(part.split()[0]) for part in entry])


class TestBistaticSample:
    def test_its_xml_alone_gives_the_standards_numbers(self) -> None:
        """The sample's ReferenceGeometry prints them; the last digit of each is what the tolerance is."""
        found = import_collection(str(SAMPLES / BISTATIC))
        assert math.degrees(found.reference.bistatic_angle) == pytest.approx(27.134278307960717, rel=1e-9)
        assert found.reference.transmitter_range == pytest.approx(616527.408630542, rel=1e-12)
        assert found.reference.receiver_range == pytest.approx(574379.6945312008, rel=1e-12)
        assert (found.center_frequency, found.aperture_time) == (8e9, 0.6412791563731501)

    def test_its_pulses_agree_with_the_reference_geometry_of_sarkit(self, bistatic) -> None:
        import sarkit.cphd as skcphd

        with bistatic.open("rb") as file, skcphd.Reader(file) as reader:
            tree, pvps = reader.metadata.xmltree, reader.read_pvps("1")
        theirs = skcphd.compute_reference_geometry(tree, pvps)
        found = import_collection(str(bistatic))
        both = theirs.find("{*}Bistatic")
        assert math.degrees(found.reference.bistatic_angle) == pytest.approx(
            float(both.findtext("{*}BistaticAngle")), rel=1e-6
        )
        at = found.reference.slow_time
        assert at == pytest.approx(
            float(theirs.findtext("{*}ReferenceTime")) - float(theirs.findtext("{*}SRPCODTime")), abs=1e-12
        )
        for name, track in (("TxPlatform", found.transmitter), ("RcvPlatform", found.receiver)):
            node = both.find(f"{{*}}{name}")
            (x, y, z), velocity = track.state.at(at)
            slant = math.hypot(x, y, z)
            assert slant == pytest.approx(float(node.findtext("{*}SlantRange")), rel=1e-9)
            angles = {
                "GrazeAngle": math.asin(z / slant),
                "AzimuthAngle": math.atan2(x, y) % (2 * math.pi),
                "DopplerConeAngle": math.acos(-np.dot((x, y, z), velocity) / slant / np.linalg.norm(velocity)),
            }
            for key, value in angles.items():
                assert math.degrees(value) == pytest.approx(float(node.findtext(f"{{*}}{key}")), rel=1e-6), key

    def test_the_paths_are_those_of_the_pulses_at_their_own_times(self, bistatic) -> None:
        """A thousandth of the wavelength of 37 mm, which the fit stops at."""
        found = import_collection(str(bistatic))
        pvps = flown.pulses_of_sample(sample(BISTATIC))
        from bisar_budget.paths.earth import axes_at

        axes = axes_at(found.scene)
        middle = 0.42063913243504203  # CODTimePoly
        point = values(sample(BISTATIC), "ReferenceGeometry/SRP/ECF")
        times = pvps["TxTime"] + np.linalg.norm(pvps["TxPos"] - point, axis=1) / flown.C - middle
        inside = np.abs(times) < found.aperture_time / 2
        for name, track in (("TxPos", found.transmitter), ("RcvPos", found.receiver)):
            for tau, place in zip(times[inside], pvps[name][inside], strict=True):
                assert math.dist(track.state.at(tau)[0], axes.place(place)) < 40e-6
        assert {found.transmitter.order, found.receiver.order} <= {2, 3}  # a satellite over 0.6 s

    def test_the_mission_can_be_checked(self, run, bistatic, tmp_path) -> None:
        output = tmp_path / "mission.yaml"
        assert run("import", bistatic, "-o", output).exit_code == 0
        text = output.read_text()
        assert "bistatic.cphd (CPHD 1.0.1, channel 1)" in text
        assert "27.134278 deg" in text
        found = import_collection(str(bistatic))
        state = parse_mission(text, "mission.yaml").geometry.receiver
        for tau in (-0.32, 0.0, 0.32):
            assert math.dist(state.at(tau)[0], found.receiver.state.at(tau)[0]) < 2e-6  # six decimals of a metre
        done = run("check", output)
        assert done.exit_code == 1  # it declares no error
        assert "the file declares no error" in done.stdout

    def test_what_is_written_is_the_tree_with_comments(self, bistatic) -> None:
        found = import_collection(str(bistatic))
        read = yaml.safe_load(mission_text(found))
        tree = mission_tree(found)
        assert read == tree | {"name": tree["name"]}

    def test_the_signal_is_not_read(self, bistatic, tmp_path, monkeypatch) -> None:
        size = os.path.getsize(bistatic)
        asked = []
        from bisar_budget.formats import containers

        whole = containers._read

        def counted(stream, file, start, length):
            asked.append((start, length))
            return whole(stream, file, start, length)

        monkeypatch.setattr(containers, "_read", counted)
        import_collection(str(bistatic))
        signal = size - 201 * 4 * 8
        assert all(start + length <= signal for start, length in asked)


def test_one_platform_agrees_with_the_reference_geometry_of_sarkit(tmp_path) -> None:
    """Its aperture reference point is in the middle of both paths; a satellite moves 30 m while a pulse is away."""
    import sarkit.cphd as skcphd

    tree = sample(BISTATIC)
    tree.find("{*}CollectionID/{*}CollectType").text = "MONOSTATIC"
    point = values(tree, "ReferenceGeometry/SRP/ECF")
    at = "ReferenceGeometry/Bistatic/TxPlatform"
    fly = flown.orbit(values(tree, f"{at}/Pos"), values(tree, f"{at}/Vel"), float(flown.text(tree, f"{at}/Time")))
    pvps = flown.pulses_of_sample(tree)
    times = float(flown.text(tree, "ReferenceGeometry/ReferenceTime")) + np.linspace(-0.46, 0.46, len(pvps))
    pvps["RcvTime"], pvps["RcvPos"], pvps["RcvVel"] = flown.light_time(fly, times, point, 1)
    path = written(tmp_path / "mono.cphd", tree, pvps)
    with path.open("rb") as file, skcphd.Reader(file) as reader:
        theirs = skcphd.compute_reference_geometry(reader.metadata.xmltree, reader.read_pvps("1")).find(
            "{*}Monostatic"
        )
    found = import_collection(str(path))
    assert found.is_monostatic
    both = [track.state.at(found.reference.slow_time) for track in (found.transmitter, found.receiver)]
    x, y, z = np.mean([place for place, _ in both], axis=0)
    velocity = np.mean([speed for _, speed in both], axis=0)
    slant = math.hypot(x, y, z)
    assert math.dist(both[0][0], both[1][0]) > 30
    expected = {
        "SlantRange": slant,
        "GrazeAngle": math.degrees(math.asin(z / slant)),
        "AzimuthAngle": math.degrees(math.atan2(x, y)) % 360,
        "DopplerConeAngle": math.degrees(math.acos(-np.dot((x, y, z), velocity) / slant / np.linalg.norm(velocity))),
    }
    for key, value in expected.items():
        assert value == pytest.approx(float(theirs.findtext(f"{{*}}{key}")), rel=1e-6), key


def test_another_channel_and_vectors_without_a_pulse(run, tmp_path) -> None:
    """The second channel has a band and pulses of its own; a vector that was not sent has no place."""
    import sarkit.cphd as skcphd

    tree = sample(BISTATIC)
    pvps = flown.pulses_of_sample(tree)
    for parent, child in (("Data", "Channel"), ("Channel", "Parameters")):
        one = tree.find(f"{{*}}{parent}/{{*}}{child}")
        other = copy.deepcopy(one)
        other.find("{*}Identifier").text = "2"
        one.addnext(other)
    tree.findall("{*}Channel/{*}Parameters/{*}FxC")[1].text = "9e9"
    for node in tree.iter("{*}NumVectors"):
        node.text = str(len(pvps))
    for node in tree.iter("{*}NumSamples"):
        node.text = "4"
    for node in tree.iter("{*}RefVectorIndex"):
        node.text = "100"
    second = tree.findall("{*}Data/{*}Channel")[1]
    second.find("{*}SignalArrayByteOffset").text = str(len(pvps) * 4 * 8)
    second.find("{*}PVPArrayByteOffset").text = str(pvps.nbytes)
    shorter = pvps.copy()
    shorter["TxTime"][::7] = math.nan
    shorter["TxPos"][::7] = math.nan
    path = tmp_path / "two.cphd"
    with path.open("wb") as file, skcphd.Writer(file, skcphd.Metadata(xmltree=tree)) as writer:
        for name, vectors in (("1", pvps), ("2", shorter)):
            writer.write_signal(name, np.zeros((len(pvps), 4), dtype=np.complex64))
            writer.write_pvp(name, vectors)
    first, other = import_collection(str(path)), import_collection(str(path), "2")
    assert (first.center_frequency, other.center_frequency) == (8e9, 9e9)
    assert (other.transmitter.samples, first.transmitter.samples) == (120, 140)
    for tau in (-0.3, 0.0, 0.3):
        assert math.dist(first.transmitter.state.at(tau)[0], other.transmitter.state.at(tau)[0]) < 30e-6
    # How many are not used was not said.
    unused = f"ithout a pulse, a time or a position, and not used: {len(pvps[::7])} of {len(pvps)} vectors"
    assert "vectors" not in run("import", path).stderr
    said = run("import", path, "--channel", "2")
    assert said.exit_code == 0
    assert f"# W{unused}." in said.stdout
    (line,) = said.stderr.splitlines()
    assert line.startswith(f"warning: w{unused}; positions of the transmitter are up to ")
    assert "; positions of the receiver are up to " in line


def test_a_moving_reference_surface_of_constant_height(tmp_path) -> None:
    """The dwell of a point away from the image's reference point, by both kinds of surface."""
    tree = sample(BISTATIC)
    pvps = flown.pulses_of_sample(tree)
    shift = 300.0  # m along IAX
    pvps["SRPPos"] += shift * values(tree, "SceneCoordinates/ReferenceSurface/Planar/uIAX")
    poly = tree.find("{*}Dwell/{*}CODTime/{*}CODTimePoly")
    poly.set("order1", "1")
    element_text = "<Coef exponent1='1' exponent2='0'>1e-4</Coef>"
    from lxml import etree

    poly.append(
        etree.fromstring(element_text.replace("<Coef", f"<Coef xmlns='{etree.QName(tree.getroot()).namespace}'"))
    )
    planar = import_collection(str(written(tmp_path / "planar.cphd", tree, pvps)))
    surface = tree.find("{*}SceneCoordinates/{*}ReferenceSurface")
    import sarkit.cphd as skcphd

    point = pvps["SRPPos"][0]
    x = skcphd.ecf_to_iac(tree, point)[0]
    assert x == pytest.approx(shift, abs=1e-6)
    before = planar.reference.slow_time
    straight = import_collection(str(written(tmp_path / "at.cphd", sample(BISTATIC))))
    assert before - straight.reference.slow_time == pytest.approx(-shift * 1e-4, abs=2e-5)
    assert "300 m from the image area's reference point" in mission_text(planar)
    surface.remove(surface[0])
    namespace = etree.QName(tree.getroot()).namespace
    surface.append(
        etree.fromstring(
            f"<HAE xmlns='{namespace}'><uIAXLL><Lat>1e-7</Lat><Lon>-1e-7</Lon></uIAXLL>"
            "<uIAYLL><Lat>1e-7</Lat><Lon>1.5e-7</Lon></uIAYLL></HAE>"
        )
    )
    level = import_collection(str(written(tmp_path / "hae.cphd", tree, pvps)))
    x = skcphd.ecf_to_iac(tree, point)[0]
    assert planar.reference.slow_time - level.reference.slow_time == pytest.approx((x - shift) * 1e-4, abs=1e-9)


ERRORS = """<ErrorParameters><Bistatic>
<TxPlatform><PosVelErr><Frame>RIC_ECI</Frame><P1>1</P1><P2>2</P2><P3>3</P3><V1>0.01</V1><V2>0.02</V2><V3>0.03</V3>
<CorrCoefs><P1P2>0</P1P2><P1P3>0</P1P3><P1V1>0</P1V1><P1V2>-0.9</P1V2><P1V3>0</P1V3><P2P3>0</P2P3><P2V1>-0.5</P2V1>
<P2V2>0</P2V2><P2V3>0</P2V3><P3V1>0</P3V1><P3V2>0</P3V2><P3V3>0</P3V3><V1V2>0</V1V2><V1V3>0</V1V3><V2V3>0</V2V3>
</CorrCoefs></PosVelErr><RadarSensor><ClockFreqSF>3e-9</ClockFreqSF><CollectionStartTime>1e-6</CollectionStartTime>
</RadarSensor></TxPlatform>
<RcvPlatform><PosVelErr><Frame>ECF</Frame><P1>1</P1><P2>1</P2><P3>1</P3><V1>0.01</V1><V2>0.01</V2><V3>0.01</V3>
</PosVelErr><RadarSensor><ClockFreqSF>4e-9</ClockFreqSF></RadarSensor></RcvPlatform>
</Bistatic></ErrorParameters>"""


class TestErrors:
    def imported(self, tmp_path, xml):
        tree = sample(BISTATIC)
        element(tree, xml, before="ProductInfo")
        return import_collection(str(written(tmp_path / "errors.cphd", tree)))

    def test_radial_in_track_cross_track_stays_and_equal_sigmas_need_no_turn(self, tmp_path) -> None:
        found = self.imported(tmp_path, ERRORS)
        tree = mission_tree(found)
        error = tree["platforms"]["transmitter"]["motion_error"]
        assert error["frame"] == "ric"
        assert error["covariance"] == {
            "position": ["1 m", "2 m", "3 m"],
            "velocity": ["0.01 m/s", "0.02 m/s", "0.03 m/s"],
            "correlation": {"position.radial-velocity.in_track": "-0.9", "position.in_track-velocity.radial": "-0.5"},
        }
        error = tree["platforms"]["receiver"]["motion_error"]
        assert (error["frame"], error["position"], error["velocity"]) == ("scene", ["1 m"] * 3, ["0.01 m/s"] * 3)
        assert tree["timing_error"] == {"linear": "5e-09"}  # √(3² + 4²)
        text = mission_text(found)
        assert "CollectionStartTime = 1e-06 has no key" in " ".join(text.replace("\n#", "").split())
        assert parse_mission(text, "m.yaml").platforms.transmitter.motion_error.covariance.sigmas[2] == 3

    def test_a_covariance_along_the_earths_axes_is_turned_into_the_scenes(self, tmp_path) -> None:
        xml = ERRORS.replace("<Frame>ECF</Frame><P1>1<", "<Frame>ECF</Frame><P1>5<")
        found = self.imported(tmp_path, xml)
        from bisar_budget.paths.earth import axes_at

        turn = np.array(axes_at(found.scene).axes)
        expected = turn @ np.diag([25.0, 1, 1]) @ turn.T
        error = found.errors.receiver
        correlation = np.array(error.correlation)[:3, :3]
        assert correlation * np.outer(error.position, error.position) == pytest.approx(expected, abs=1e-9)
        assert "stated in ECF; they are turned" in " ".join(mission_text(found).replace("\n#", "").split())
        parse_mission(mission_text(found), "m.yaml")

    def test_in_track_over_the_ground_is_turned_to_that_against_the_stars(self, tmp_path) -> None:
        """About the radial axis, by the angle between both velocities: the larger sigma leaves its axis."""
        found = self.imported(tmp_path, ERRORS.replace("RIC_ECI", "RIC_ECF"))
        error = found.errors.transmitter
        assert error.position[0] == pytest.approx(1, rel=1e-12)
        assert sum(sigma**2 for sigma in error.position) == pytest.approx(14, rel=1e-12)
        assert 2 < error.position[1] < 2.1
        assert error.frame == "ric"

    def test_correlations_that_no_error_has_are_said_and_left_out(self, tmp_path) -> None:
        found = self.imported(tmp_path, ERRORS.replace("<P1V3>0<", "<P1V3>0.9<").replace("<V2V3>0<", "<V2V3>0.9<"))
        assert found.errors.transmitter.correlation == ()
        assert any("no covariance" in remark for remark in found.remarks)

    @pytest.mark.parametrize(
        ("wrong", "right", "at"),
        [
            ("<P3>3<", "<P3>-3<", "PosVelErr"),
            ("RIC_ECI", "NED", "Frame"),
            (">-0.9<", ">-1.9<", "P1V2"),
            ("<P3>3<", "<P3>1e308<", "PosVelErr"),  # its square is infinite, and had no eigenvalues
            ("<P3>3<", "<P3>1.001e9<", "PosVelErr"),
            ("<V1>0.01<", "<V1>1e154<", "PosVelErr"),
        ],
    )
    def test_what_is_no_error(self, tmp_path, wrong, right, at) -> None:
        with pytest.raises(FormatError, match=f"ErrorParameters/Bistatic/TxPlatform/PosVelErr.*{at}|{at}"):
            self.imported(tmp_path, ERRORS.replace(wrong, right))

    def test_one_platform_has_one_error(self, tmp_path) -> None:
        xml = ERRORS[ERRORS.index("<PosVelErr><Frame>ECF") : ERRORS.index("</PosVelErr><RadarSensor><ClockFreqSF>4")]
        xml = f"<ErrorParameters><Monostatic>{xml}</PosVelErr><RadarSensor><RangeBias>0.15</RangeBias></RadarSensor>"
        found = self.imported(tmp_path, f"{xml}</Monostatic></ErrorParameters>")
        assert found.errors.common.position == pytest.approx((1, 1, 1))
        assert found.errors.timing_constant == pytest.approx(0.3 / flown.C)
        assert mission_tree(found)["common_motion_error"]["velocity"] == ["0.01 m/s"] * 3
        parse_mission(mission_text(found), "m.yaml")


class TestSicd:
    def test_the_sample_gives_its_own_geometry(self) -> None:
        """SCPCOA of the sample; its polynomials are of the fifth order."""
        tree = sample("example-sicd-1.4.0.xml")
        found = import_collection(str(SAMPLES / "example-sicd-1.4.0.xml"))
        at = "SCPCOA/Bistatic"
        assert math.degrees(found.reference.bistatic_angle) == pytest.approx(
            float(flown.text(tree, f"{at}/BistaticAng")), rel=1e-9
        )
        for side, length in (("Tx", found.reference.transmitter_range), ("Rcv", found.reference.receiver_range)):
            assert length == pytest.approx(float(flown.text(tree, f"{at}/{side}Platform/SlantRange")), rel=1e-9)
        assert found.center_frequency == pytest.approx(10e9)
        assert found.bandwidth == pytest.approx(337.4976e6, rel=1e-6)

    def test_a_band_at_zero_is_refused(self, tmp_path) -> None:
        """It used to end as a fault of the tool itself, by a division by zero."""
        tree = sample("example-sicd-1.4.0.xml")
        for name in ("MinProc", "MaxProc"):
            tree.find(f"{{*}}ImageFormation/{{*}}TxFrequencyProc/{{*}}{name}").text = "0"
        tree.write(str(tmp_path / "zero.xml"))
        with pytest.raises(FormatError, match=r"zero\.xml: its centre frequency is 0 Hz$"):
            import_collection(str(tmp_path / "zero.xml"))

    def with_errors(self, tmp_path, inner: str, kind: str = "BISTATIC"):
        tree = sample("example-sicd-1.4.0.xml")
        tree.find("{*}CollectionInfo/{*}CollectType").text = kind
        element(tree, f"<ErrorStatistics>{inner}</ErrorStatistics>")
        path = tmp_path / "errors.xml"
        tree.write(str(path))
        return import_collection(str(path))

    def test_covariances_of_both_platforms_and_clocks(self, tmp_path) -> None:
        """Volume 1: a covariance of each in its frame; of times and clocks the second and fourth are clocks."""
        along = [(1, 1, 1.0), (2, 2, 4.0), (3, 3, 9.0), (4, 4, 1e-4), (5, 5, 4e-4), (6, 6, 9e-4), (1, 5, -0.018)]
        alike = [(row, row, 4.0 if row < 4 else 1e-4) for row in range(1, 7)]
        clocks = [(2, 2, 9e-18), (4, 4, 16e-18), (2, 4, 5e-18), (1, 1, 1e-12)]

        def matrix(name: str, size: int, entries: list[tuple[int, int, float]]) -> str:
            inner = "".join(f'<Entry index1="{row}" index2="{column}">{x}</Entry>' for row, column, x in entries)
            return f'<{name} size1="{size}" size2="{size}">{inner}</{name}>'

        found = self.with_errors(
            tmp_path,
            "<BistaticComponents><PosVelErr><TxFrame>RIC_ECI</TxFrame>"
            + matrix("TxPVCov", 6, along)
            + "<RcvFrame>ECF</RcvFrame>"
            + matrix("RcvPVCov", 6, alike)
            + matrix("TxRcvPVXCov", 6, [(1, 1, 0.1)])
            + "</PosVelErr><RadarSensor>"
            + matrix("TxRcvTimeFreq", 4, clocks)
            + "</RadarSensor></BistaticComponents>",
        )
        error = found.errors.transmitter
        assert error.frame == "ric"
        assert error.position == pytest.approx((1, 2, 3), rel=1e-12)
        assert error.velocity == pytest.approx((0.01, 0.02, 0.03), rel=1e-12)
        assert error.correlation[0][4] == pytest.approx(-0.9, rel=1e-12)
        error = found.errors.receiver
        assert (error.frame, error.correlation) == ("scene", ())
        assert (*error.position, *error.velocity) == pytest.approx((2, 2, 2, 0.01, 0.01, 0.01), rel=1e-9)
        assert found.errors.timing_linear == pytest.approx(math.sqrt(15e-18), rel=1e-12)  # 9 + 16 less twice 5
        said = " ".join(found.remarks)
        assert "TxRcvPVXCov: how errors of both platforms go together is not taken over" in said
        assert "errors of the times of transmission and reception are not taken over" in said
        parse_mission(mission_text(found), "m.yaml")

    def test_components_of_one_platform(self, tmp_path) -> None:
        sigmas = "<P1>1</P1><P2>1</P2><P3>1</P3><V1>0.01</V1><V2>0.01</V2><V3>0.01</V3>"
        found = self.with_errors(
            tmp_path,
            f"<Components><PosVelErr><Frame>ECF</Frame>{sigmas}</PosVelErr>"
            "<RadarSensor><RangeBias>0.15</RangeBias></RadarSensor></Components>",
            kind="MONOSTATIC",
        )
        assert found.errors.common.position == pytest.approx((1, 1, 1))
        assert found.errors.timing_constant == pytest.approx(0.3 / flown.C)
        assert found.errors.transmitter is None
        parse_mission(mission_text(found), "m.yaml")

    def test_a_nitf_file(self, tmp_path) -> None:
        import sarkit.sicd as sksicd

        tree = sample("example-sicd-1.4.0.xml")
        security = {"security": {"clas": "U"}}
        meta = sksicd.NitfMetadata(
            xmltree=tree,
            file_header_part={"ostaid": "nowhere", **security},
            im_subheader_part={"isorce": "none", **security},
            de_subheader_part=security,
        )
        path = tmp_path / "small.nitf"
        for name, size in (("NumRows", "4"), ("NumCols", "4")):
            for node in tree.iter(f"{{*}}{name}"):
                node.text = size
        with path.open("wb") as file, sksicd.NitfWriter(file, meta) as writer:
            writer.write_image(np.zeros((4, 4), dtype=np.complex64))
        found = import_collection(str(path))
        alone = import_collection(str(SAMPLES / "example-sicd-1.4.0.xml"))
        assert found.transmitter == alone.transmitter
        cut = tmp_path / "cut.nitf"
        cut.write_bytes(path.read_bytes()[:-40])
        with pytest.raises(FormatError, match="cut off"):
            import_collection(str(cut))


def test_crsd(tmp_path) -> None:
    """A window that opens before the echo: the receiver's place is that of the echo's time."""
    import sarkit.crsd as skcrsd

    tree = sample("example-crsd-1.0.xml")
    count = 101
    for path in ("Data/Transmit/TxSequence/NumPulses", "Data/Receive/Channel/NumVectors"):
        tree.find("/".join(f"{{*}}{step}" for step in path.split("/"))).text = str(count)
    tree.find("{*}Data/{*}Receive/{*}Channel/{*}NumSamples").text = "2"
    for node in tree.iter("{*}RefVectorIndex", "{*}RefPulseIndex", "{*}RefVectorPulseIndex"):
        node.text = "50"
    point = values(tree, "ReferenceGeometry/RefPoint/ECF")
    fly = [
        orbit
        for side in ("Tx", "Rcv")
        for orbit in [
            flown.orbit(
                values(tree, f"ReferenceGeometry/{side}Parameters/APCPos"),
                values(tree, f"ReferenceGeometry/{side}Parameters/APCVel"),
                float(flown.text(tree, f"ReferenceGeometry/{side}Parameters/Time")),
            )
        ]
    ]
    times = float(flown.text(tree, "ReferenceGeometry/SARImage/ReferenceTime")) + np.linspace(-0.9, 0.9, count)
    ppps = np.zeros(count, skcrsd.get_ppp_dtype(tree))
    pvps = np.zeros(count, skcrsd.get_pvp_dtype(tree))
    sent, ppps["TxPos"], ppps["TxVel"] = flown.light_time(fly[0], times, point, -1)
    heard = flown.light_time(fly[1], times, point, 1)[0]
    begun = heard - 300e-6
    for field, value in ((ppps["TxTime"], sent), (pvps["RcvStart"], begun)):
        field["Int"], field["Frac"] = np.floor(value), value - np.floor(value)
    pvps["RcvPos"], pvps["RcvVel"] = fly[1](begun)
    pvps["TxPulseIndex"] = np.arange(count)
    path = tmp_path / "small.crsd"
    with path.open("wb") as file, skcrsd.Writer(file, skcrsd.Metadata(xmltree=tree)) as writer:
        writer.write_signal("the channel", np.zeros((count, 2), dtype=[("real", "i1"), ("imag", "i1")]))
        writer.write_pvp("the channel", pvps)
        writer.write_ppp("the sequence", ppps)
    found = import_collection(str(path))
    assert found.unused == ""
    pvps["RcvPos"][3], ppps["TxTime"]["Frac"][4], pvps["TxPulseIndex"][90] = math.nan, math.nan, -1
    with path.open("wb") as file, skcrsd.Writer(file, skcrsd.Metadata(xmltree=tree)) as writer:
        writer.write_signal("the channel", np.zeros((count, 2), dtype=[("real", "i1"), ("imag", "i1")]))
        writer.write_pvp("the channel", pvps)
        writer.write_ppp("the sequence", ppps)
    lacking = import_collection(str(path))
    assert lacking.unused == f"without a pulse, a time or a position, and not used: 3 of {count} vectors"
    assert lacking.transmitter.state.position == pytest.approx(found.transmitter.state.position, abs=1e-4)
    assert lacking.reference.receiver_range == pytest.approx(found.reference.receiver_range, abs=1e-4)
    assert found.channel == "the channel"
    for side, length in (("Tx", found.reference.transmitter_range), ("Rcv", found.reference.receiver_range)):
        assert length == pytest.approx(
            float(flown.text(tree, f"ReferenceGeometry/{side}Parameters/SlantRange")), abs=1e-3
        )
    assert math.degrees(found.reference.bistatic_angle) == pytest.approx(0.002767539111287036, rel=1e-4)
    # Its covariance along the Earth's axes is that of a platform that transmits and receives: traces stay.
    error = found.errors.transmitter
    assert error == found.errors.receiver
    assert error.frame == "scene"
    assert sum(sigma**2 for sigma in error.position) == pytest.approx(0 + 1 + 2, rel=1e-9)
    assert sum(sigma**2 for sigma in error.velocity) == pytest.approx(3 + 4 + 5, rel=1e-9)
    assert "errors of its times and clock are not taken over" in " ".join(found.remarks)
    parse_mission(mission_text(found), "m.yaml")


class TestRefused:
    """One line that names the file and the place, exit 2, and nothing written."""

    def refused(self, run, path, tmp_path, *options):
        output = tmp_path / "out.yaml"
        result = run("import", path, "-o", output, *options)
        assert result.exit_code == 2
        assert not output.exists()
        assert result.stderr.count("\n") == 1
        assert str(path) in result.stderr
        return result.stderr

    @pytest.mark.parametrize("part", [0.001, 0.05, 0.3, 0.6, 0.9, 0.9999])
    def test_cut_off(self, run, bistatic, tmp_path, part) -> None:
        data = bistatic.read_bytes()
        path = tmp_path / "cut.cphd"
        path.write_bytes(data[: int(len(data) * part)])
        assert "byte" in self.refused(run, path, tmp_path)

    @pytest.mark.parametrize(
        "data", [b"", b"GIF89a....", b"NITF02.10", b"<svg/>", b"<a><b></a>", b"CPHD/1.1.0\nX\n\f\n"]
    )
    def test_something_else(self, run, tmp_path, data) -> None:
        path = tmp_path / "else.cphd"
        path.write_bytes(data)
        assert "byte" in self.refused(run, path, tmp_path)

    def test_no_file(self, run, tmp_path) -> None:
        assert "No such file" in self.refused(run, tmp_path / "none.cphd", tmp_path)
        assert "no regular file" in self.refused(run, tmp_path, tmp_path)

    @pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
    def test_entities(self, run, tmp_path, encoding) -> None:
        text = (SAMPLES / BISTATIC).read_text()
        text = text[text.index("<CPHD") :].replace("<CoreName>SyntheticCore<", "<CoreName>&x;<")
        path = tmp_path / "entities.xml"
        declared = f'<?xml version="1.0" encoding="{encoding}"?><!DOCTYPE CPHD [<!ENTITY x SYSTEM "/etc/hostname">]>'
        path.write_bytes((declared + text).encode(encoding))
        self.refused(run, path, tmp_path)

    def test_references_to_other_files(self, run, tmp_path) -> None:
        text = (SAMPLES / BISTATIC).read_text()
        included = '<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="/etc/hostname" parse="text"/>'
        path = tmp_path / "include.xml"
        path.write_text(text.replace("SyntheticCore<", included + "<"))
        assert "/CPHD/CollectionID/CoreName/include" in self.refused(run, path, tmp_path)

    def test_a_channel_that_is_not_there(self, run, bistatic, tmp_path) -> None:
        said = self.refused(run, bistatic, tmp_path, "--channel", "HV")
        assert "/CPHD/Channel/Parameters has no channel 'HV'; it has 1" in said

    @pytest.mark.parametrize(
        ("path", "value"),
        [
            ("Channel/Parameters/FxC", "nan"),
            ("Channel/Parameters/FxC", "-1"),
            ("Channel/Parameters/RefVectorIndex", "99999"),
            ("Dwell/DwellTime/DwellTimePoly/Coef", "0"),
            ("Dwell/DwellTime/DwellTimePoly/Coef", "1e-6"),
            ("Dwell/CODTime/Identifier", "other"),
            ("PVP/TxPos/Format", "nonsense"),
            ("PVP/TxPos/Format", "F8"),
            ("PVP/TxPos/Offset", "99999"),
            ("Global/Timeline/CollectionStart", "yesterday"),
        ],
    )
    def test_values_that_cannot_be(self, run, bistatic, tmp_path, path, value) -> None:
        """The XML is exchanged for one as long, so that the blocks stay where they are."""
        data = bistatic.read_bytes()
        start, end = data.index(b"<CPHD"), data.index(b"</CPHD>") + 7
        from lxml import etree

        root = etree.fromstring(data[start:end])
        root.find("/".join(f"{{*}}{step}" for step in path.split("/"))).text = value
        for node in root.findall("{*}GeoInfo"):  # makes room
            root.remove(node)
        xml = etree.tostring(root)
        xml += b" " * (end - start - len(xml))
        assert len(xml) == end - start
        bad = tmp_path / "bad.cphd"
        bad.write_bytes(data[:start] + xml + data[end:])
        self.refused(run, bad, tmp_path)

    def test_an_existing_file_stays(self, run, bistatic, tmp_path) -> None:
        output = tmp_path / "mission.yaml"
        output.write_text("mine")
        assert run("import", bistatic, "-o", output).exit_code == 2
        assert output.read_text() == "mine"
        assert run("import", bistatic, "-o", output, "--force").exit_code == 0
        assert run("import", bistatic, "-o", bistatic, "--force").exit_code == 2

    def test_without_the_extra(self, run, bistatic, monkeypatch) -> None:
        import sys

        monkeypatch.setitem(sys.modules, "sarkit", None)
        result = run("import", bistatic)
        assert result.exit_code == 2
        assert "pip install sarkit" in result.stderr


def test_names_of_a_file_stay_in_their_comment(tmp_path) -> None:
    tree = copy.deepcopy(sample(BISTATIC))
    tree.find("{*}CollectionID/{*}CoreName").text = 'x"\nradar: {}\u2028# y'
    path = written(tmp_path / "a\nradar: {}.cphd", tree)
    read = yaml.safe_load(mission_text(import_collection(str(path))))
    assert read["radar"]["center_frequency"] == "8 GHz"


def test_a_header_says_nothing_of_the_model_so_the_full_one_judges(tmp_path) -> None:
    text = mission_text(import_collection(str(written(tmp_path / "a.cphd", sample(BISTATIC)))))
    assert "allocation" not in yaml.safe_load(text)
    rules = parse_mission(text).allocation
    assert (rules.model, rules.combine) == ("full", "rss")


@pytest.mark.parametrize(("off", "exit_code"), [(5.0, 0), (5e7, 2)])
def test_a_vector_that_is_elsewhere_is_said_or_refused(run, tmp_path, off, exit_code) -> None:
    """By 5 m a warning; by more than a hundredth of the range no mission."""
    tree = sample(BISTATIC)
    pvps = flown.pulses_of_sample(tree)
    pvps["TxPos"][100, 0] += off
    found = run("import", written(tmp_path / "far.cphd", tree, pvps), "-o", tmp_path / "mission.yaml")
    assert found.exit_code == exit_code, found.stderr
    assert (tmp_path / "mission.yaml").exists() is (exit_code == 0)
    said = (
        "warning: positions of the transmitter are" if exit_code == 0 else "a transmitter position is 49612 km from"
    )
    assert said in found.stderr


@pytest.mark.parametrize("place", [1e200, -1e308, 1e10, math.inf, math.nan])
def test_a_place_beyond_the_moon_is_none(run, tmp_path, place) -> None:
    """NumPy warned of an overflow, and the pulse was left out in silence: its time lay outside of the dwell."""
    tree = sample(BISTATIC)
    pulses = flown.pulses_of_sample(tree)
    pulses["TxPos"][50, 0] = place
    found = run("import", written(tmp_path / "a.cphd", tree, pulses))
    assert found.exit_code == 0
    assert "without a pulse, a time or a position, and not used: 1 of 201 vectors" in found.stderr


@pytest.mark.parametrize("value", ["1e308", "1e200", "-1e308"])
def test_a_covariance_that_is_no_errors_ends_in_2(run, tmp_path, value) -> None:
    tree = sample(BISTATIC)
    element(tree, ERRORS.replace("<V1>0.01<", f"<V1>{value}<"), before="ProductInfo")
    found = run("import", written(tmp_path / "errors.cphd", tree))
    assert found.exit_code == 2
    assert "PosVelErr" in found.stderr
    assert "Traceback" not in found.stderr
