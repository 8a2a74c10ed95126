"""Sphinx's settings for this book; `make docs` builds it into docs/_build/html."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # formulas, names and rooms

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
    "formulas",
    "names",
    "rooms",
]
exclude_patterns = ["_build"]
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

html_theme = "furo"
html_title = f"lightloc {version}"
html_static_path = ["_static"]
html_css_files = ["book.css"]
html_math_renderer = "drawn"
math_eqref_format = "Eq. {number}"
html_copy_source = html_show_sourcelink = False
