"""Sphinx settings of the documentation: `sphinx-build -j auto -EW --keep-going -q docs build/docs`."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent / "_ext"))

from bisar_budget import __version__

project = "bisar-budget"
author = "The bisar-budget developers"
project_copyright = author
version = release = __version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_click",
    "sphinx_copybutton",
    "executed",  # these five are in _ext
    "generated",
    "outside",
    "drawn",
    "checked",
]
exclude_patterns = ["_ext"]
smartquotes = False  # two hyphens are an option, not a dash
source_suffix = {".md": "myst-nb", ".ipynb": "myst-nb"}

# Notebooks are kept without outputs, and run each time; a cell that fails ends the build.
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_output_stderr = "remove"  # bars of progress
nb_merge_streams = True

myst_enable_extensions = ["amsmath", "attrs_inline", "colon_fence", "deflist", "dollarmath"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 3

html_theme = "furo"
html_title = f"bisar-budget {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False
html_math_renderer = "mathml"
copybutton_prompt_text = "$ "
copybutton_only_copy_prompt_lines = True

autodoc_member_order = "bysource"
autodoc_typehints = "none"  # docstrings say types, with shapes and units
napoleon_numpy_docstring = True
napoleon_use_rtype = False

nitpicky = True
# Types in docstrings are words of NumPy, or names that have no page here.
nitpick_ignore_regex = [
    ("py:class", ".*"),
    ("py:exc", "MissingPackageError|MissingExtraError|MissionError|QuestionError|SimulationError|TableError"),
]
