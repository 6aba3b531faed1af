"""Files of radar formats for tests: samples of the standards, with satellites that fly as gravity has them."""

import copy
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

SAMPLES = Path(__file__).parent / "samples"
C = 299792458.0
GM, TURN = 3.986004418e14, 7.292115e-5  # m³/s², rad/s; WGS-84


def _rates(state):
    """Two bodies, in axes that turn with the Earth."""
    r, v = state[:3], state[3:]
    omega = np.array([0, 0, TURN])
    pull = -GM * r / np.linalg.norm(r) ** 3
    return np.concatenate([v, pull - 2 * np.cross(omega, v) - np.cross(omega, np.cross(omega, r))])


def orbit(position, velocity, epoch, half=2.0, step=0.01):
    """Places and velocities as functions of time, by Runge-Kutta and Hermite's cubic: better than a nanometre."""
    return _integrated(tuple(position), tuple(velocity), epoch, half, step)


@cache
def _integrated(position, velocity, epoch, half, step):
    sides = []
    for sign in (-1, 1):
        states = [np.array([*position, *velocity])]
        h = sign * step
        for _ in range(round(half / step)):
            s = states[-1]
            a = _rates(s)
            b = _rates(s + h / 2 * a)
            c = _rates(s + h / 2 * b)
            d = _rates(s + h * c)
            states.append(s + h / 6 * (a + 2 * b + 2 * c + d))
        sides.append(states)
    states = np.array(sides[0][:0:-1] + sides[1])
    start = epoch - step * round(half / step)

    def at(times):
        times = np.atleast_1d(times)
        index = np.clip(((times - start) / step).astype(int), 0, len(states) - 2)
        x = ((times - start) / step - index)[:, None]
        p, q = states[index], states[index + 1]
        h00, h10 = 2 * x**3 - 3 * x**2 + 1, x**3 - 2 * x**2 + x
        places = h00 * p[:, :3] + h10 * step * p[:, 3:] + (1 - h00) * q[:, :3] + (x**3 - x**2) * step * q[:, 3:]
        return places, p[:, 3:] + x * (q[:, 3:] - p[:, 3:])

    return at


def light_time(at, times, point, sign):
    """Times at which a platform sends (-1) or hears (1) what is at a point at some times, with place and velocity."""
    own = times
    for _ in range(6):
        own = times + sign * np.linalg.norm(at(own)[0] - point, axis=1) / C
    return own, *at(own)


def sample(name: str) -> Any:
    """XML tree of a sample."""
    etree = pytest.importorskip("lxml.etree")
    return etree.parse(str(SAMPLES / name))


def values(tree, path, names="XYZ"):
    node = tree.find("/".join(f"{{*}}{step}" for step in path.split("/")))
    return np.array([float(node.findtext(f"{{*}}{name}")) for name in names])


def text(tree, path):
    return tree.findtext("/".join(f"{{*}}{step}" for step in path.split("/")))


def element(tree, xml: str, before: str | None = None) -> None:
    """Put an element into a document of its namespace, before another one."""
    etree = pytest.importorskip("lxml.etree")
    root = tree.getroot()
    namespace = etree.QName(root).namespace
    node = etree.fromstring(xml.replace(">", f' xmlns="{namespace}">', 1))
    if before is None:
        root.append(node)
    else:
        root.find(f"{{*}}{before}").addprevious(node)


def pulses_of_sample(tree, count: int = 201):
    """PVPs of the bistatic sample: both satellites on orbits through its reference geometry."""
    skcphd = pytest.importorskip("sarkit.cphd")
    point = values(tree, "ReferenceGeometry/SRP/ECF")
    middle = float(text(tree, "ReferenceGeometry/ReferenceTime"))
    bistatic = "ReferenceGeometry/Bistatic"
    fly = [
        orbit(
            values(tree, f"{bistatic}/{side}/Pos"),
            values(tree, f"{bistatic}/{side}/Vel"),
            float(text(tree, f"{bistatic}/{side}/Time")),
        )
        for side in ("TxPlatform", "RcvPlatform")
    ]
    times = middle + np.linspace(-0.46, 0.46, count)
    pvps = np.zeros(count, skcphd.get_pvp_dtype(tree))
    pvps["TxTime"], pvps["TxPos"], pvps["TxVel"] = light_time(fly[0], times, point, -1)
    pvps["RcvTime"], pvps["RcvPos"], pvps["RcvVel"] = light_time(fly[1], times, point, 1)
    pvps["SRPPos"] = point
    return pvps


def written(path: Path, tree, pvps=None) -> Path:
    """A CPHD file by sarkit, of a signal that is nothing."""
    skcphd = pytest.importorskip("sarkit.cphd")
    tree = copy.deepcopy(tree)
    pvps = pulses_of_sample(tree) if pvps is None else pvps
    channel = tree.find("{*}Data/{*}Channel")
    channel.find("{*}NumVectors").text = str(len(pvps))
    channel.find("{*}NumSamples").text = "4"
    tree.find("{*}Channel/{*}Parameters/{*}RefVectorIndex").text = str(len(pvps) // 2)
    with path.open("wb") as file, skcphd.Writer(file, skcphd.Metadata(xmltree=tree)) as writer:
        writer.write_signal("1", np.zeros((len(pvps), 4), dtype=np.complex64))
        writer.write_pvp("1", pvps)
    return path
