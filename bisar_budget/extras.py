"""Packages that the optional parts of the tool need, and the command that installs them.

Messages name the packages, not the extra: bisar-budget is not on PyPI, and someone else may register its name there.
"""

from collections.abc import Mapping

# The `optional-dependencies` of pyproject.toml without versions. Extras for developers are left out.
PACKAGES_OF_EXTRA: Mapping[str, tuple[str, ...]] = {
    "cluster": ("distributed", "pyarrow"),
    "fast": ("finufft", "numba"),
    "formats": ("sarkit",),
    "logs": ("pynmea2",),
    "office": ("openpyxl",),
    "orbits": ("pyerfa", "sgp4"),
    "tables": ("netCDF4", "pyarrow", "xarray"),
}


def install_command(extra: str) -> str:
    """Command that installs the packages of an extra into the current environment."""
    return f"pip install {' '.join(PACKAGES_OF_EXTRA[extra])}"


class MissingExtraError(Exception):
    """The packages of an extra are not installed; the message names them and the command that installs them."""
