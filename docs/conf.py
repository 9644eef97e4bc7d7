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
aliases = (
    "Amplitude ArrayLike Change Complex Condition DampingLike DirectionLike EntriesLike Flags Force Index"
    " Labelled Masses Matrix MatrixLike Model Moving Names PerContact Real Velocity"
)
autodoc_type_aliases = {name: name for name in aliases.split()}
python_maximum_signature_line_length = 100
autodoc_default_options = {"members": True, "exclude-members": "__init__"}
napoleon_numpy_docstring = True
napoleon_google_docstring = False
napoleon_use_ivar = True
# The signature has the types.
napoleon_attr_annotations = False
myst_heading_anchors = 3
myst_enable_extensions = ["dollarmath"]
# A word in a docstring may be an attribute of several classes; none is meant then.
suppress_warnings = ["ref.python"]


#: What Python writes of a type or a default, and what a reader needs of it.
READABLE = {
    r"TypeAliasForwardRef\('(\w+)'\)": r"\1",
    r"~?numpy\.ndarray\[tuple\[~?(typing\.)?Any, \.\.\.\], ~?numpy\.dtype\[~?numpy\.\w+\]\]": "ndarray",
    r"<factory>": "{}",
    r"<class '(\w+)'>": r"\1",
}


def readable(app, what, name, thing, options, signature, returned):
    """Write types by their names, and defaults as Python reads them."""
    texts = [signature, returned]
    for pattern, plain in READABLE.items():
        texts = [text and re.sub(pattern, plain, text) for text in texts]
    return tuple(texts)


def swapped(old, new):
    """Return a listener that replaces a letter in the docstrings of attributes and properties."""

    def swap(app, what, name, thing, options, lines):
        if what in ("attribute", "property"):
            lines[:] = [line.replace(old, new) for line in lines]

    return swap


def setup(app):
    """Let napoleon see no colon in a property's docstring: it would take what stands before for a type."""
    app.connect("autodoc-process-signature", readable)
    app.connect("autodoc-process-docstring", swapped(":", "\N{RATIO}"), priority=400)
    app.connect("autodoc-process-docstring", swapped("\N{RATIO}", ":"), priority=600)
