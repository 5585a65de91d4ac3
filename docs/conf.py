"""How the documentation is built: `make docs`."""

from __future__ import annotations

import os
import sys
from pathlib import Path

os.environ["MPLBACKEND"] = "agg"  # no window on any machine
os.environ["OPENBLAS_NUM_THREADS"] = "1"  # tests run beside the build, and threads that wait would take their cores
sys.path.insert(0, str(Path(__file__).parent / "_ext"))

import dforce as df

project = "dForce"
author = "The dForce developers"
copyright = "The dForce developers"
version = release = df.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
    "dforce_docs",
]
exclude_patterns = ["_build"]
nitpicky = False
default_role = "literal"  # docstrings name parameters in single backticks
myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
suppress_warnings = ["toc.empty_glob"]

autodoc_typehints = "signature"
autodoc_member_order = "bysource"
autosummary_generate = True
autosummary_ignore_module_all = False
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True

html_title = "dForce"
html_favicon = "_static/logo.svg"
html_theme = "pydata_sphinx_theme"
html_static_path = ["_static"]
html_css_files = ["dforce.css"]
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {
    "logo": {"image_light": "_static/logo.svg", "image_dark": "_static/logo-dark.svg", "text": "dForce"},
    "navbar_align": "left",
    "header_links_before_dropdown": 5,  # all of them: nothing stands under "More"
    "show_prev_next": True,
    "navigation_with_keys": False,
    "show_version_warning_banner": False,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
html_sidebars = {"index": []}
html_math_renderer = "mathml"

copybutton_exclude = ".linenos, .gp, .go"

sphinx_gallery_conf = {
    "examples_dirs": ["../examples/tutorials", "../examples/paper"],
    "gallery_dirs": ["tutorials", "paper"],
    "filename_pattern": r"\.py$",
    "ignore_pattern": r"brush\.py$",  # a file that a tutorial shows and uses
    "within_subsection_order": "dforce_docs.gallery.Order",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "remove_config_comments": True,
    "show_signature": False,
    "min_reported_time": 1e9,  # how long a page took to make is no news to its reader
    "write_computation_times": False,
    "show_memory": False,
    "plot_gallery": "True",
    "image_srcset": ["2x"],
    "reset_modules": ("dforce_docs.gallery.start_afresh",),
}
