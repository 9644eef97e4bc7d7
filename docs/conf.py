"""The documentation: pages in Markdown, the reference from the docstrings."""

import re

import stickslip

project = "stickslip"
author = "The stickslip developers"
release = version = stickslip.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    # Brings the scripts and fonts that typeset equations, so that pages load nothing from the network.
    "sphinx-mathjax-offline",
]
source_suffix = {".md": "markdown"}
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = f"stickslip {release}"
html_show_copyright = False
html_static_path = ["_static"]
html_css_files = ["wide.css"]

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
# Types by the names that the code gives them, and one argument per line where a signature is long.
aliases = "ArrayLike Change Complex Condition Force Index Labelled Masses Model Moving Names PerContact Real"
autodoc_type_aliases = {name: name for name in [*aliases.split(), "Velocity"]}
python_maximum_signature_line_length = 100
autodoc_default_options = {"members": True, "exclude-members": "__init__"}
napoleon_numpy_docstring = True
napoleon_google_docstring = False
napoleon_use_ivar = True
myst_heading_anchors = 3
myst_enable_extensions = ["dollarmath"]
# A word in a docstring may be an attribute of several classes; none is meant then.
suppress_warnings = ["ref.python"]


def setup(app):
    """Write an alias that may be None as its name too."""

    def readable(app, what, name, thing, options, signature, returned):
        plain = [
            text and re.sub(r"TypeAliasForwardRef\('(\w+)'\)", r"\1", text) for text in (signature, returned)
        ]
        return tuple(plain)

    app.connect("autodoc-process-signature", readable)
