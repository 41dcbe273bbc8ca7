"""How the documentation becomes a site: `make docs` writes it to `site/`; open `site/docs/index.html`.

The source is the whole checkout, so that links between README, docs and changelog are the ones people follow where the
files are read as they are.
"""

from marsupial import __version__

project = "marsupial"
author = "marsupial contributors"
release = version = __version__
copyright = f"{author}. marsupial {version}, Apache License 2.0"
root_doc = "docs/index"
include_patterns = [
    "README.md", "CHANGELOG.md", "CONTRIBUTING.md", "docs/**", "pddl/README.md", "benchmarks/figures/tables.md",
]  # fmt: skip
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode"]

myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence"]
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 120

autodoc_member_order = "bysource"
autodoc_typehints = "description"
napoleon_use_ivar = True

html_theme = "furo"
html_title = f"marsupial {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
