"""Sphinx's settings for this book; `make docs` builds it into docs/_build/html."""

import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # formulas, names and rooms

from sphinx.application import Sphinx

import lightloc

project = "lightloc"
author = "The lightloc developers"
copyright = author
release = version = lightloc.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_gallery.gen_gallery",
    "formulas",
    "names",
    "rooms",
]
exclude_patterns = ["_build", "gallery"]
default_role = "py:obj"  # a name in single backticks links, or is code where it is not public

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"  # of a package: the order of its __all__
autodoc_typehints_format = "short"
autodoc_type_aliases = {name: name for name in ("ArrayLike", "NDArray", "Indirect")}
python_maximum_signature_line_length = 120
napoleon_google_docstring = False
napoleon_use_rtype = False  # a type beside its sentence, where there is but one
viewcode_line_numbers = True

sphinx_gallery_conf = {
    "examples_dirs": "gallery",
    "gallery_dirs": "drawn",  # made anew where a script has changed
    "filename_pattern": r"\.py$",
    "within_subsection_order": "FileNameSortKey",
    "reset_modules": ("matplotlib", "gallery_style.style"),
    "image_srcset": ["2x"],
    "thumbnail_size": (600, 420),
    "abort_on_example_error": True,
    "capture_repr": (),
    "remove_config_comments": True,
    "notebook_extensions": set(),
    "download_all_examples": False,
    "write_computation_times": False,
    "min_reported_time": float("inf"),
    "show_signature": False,
}
CLUTTER = re.compile(
    r"\.\. only:: html\n\n    \.\. note::\n +:class: sphx-glr-download-link-note\n.*?\n\n(?=\S)"
    r"| +\.\. container:: sphx-glr-download sphx-glr-download-zip\n.*?`\n",
    re.DOTALL,
)

html_theme = "furo"
html_title = f"lightloc {version}"
html_static_path = ["_static"]
html_css_files = ["book.css"]
html_math_renderer = "drawn"
math_eqref_format = "Eq. {number}"
html_copy_source = html_show_sourcelink = False


def without_clutter(app: Sphinx, page: str, source: list[str]) -> None:
    """Of the gallery's downloads, leave the scripts."""
    if page.startswith("drawn/"):
        source[0] = CLUTTER.sub("", source[0])


def setup(app: Sphinx) -> None:
    app.connect("source-read", without_clutter)
