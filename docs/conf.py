"""Settings of the documentation site: `make docs`. Nothing is fetched when a page is viewed."""

import os
from functools import partial
from importlib.metadata import version as installed_version
from pathlib import Path
from typing import Any

from docutils.nodes import SkipNode
from latex2mathml.converter import convert
from sphinx.application import Sphinx

from docs.site_parts import (
    ROOT,
    examples_markdown,
    notebook_markdown,
    replay_frame,
    versions_list,
    with_example_links,
    with_outside_links,
    write_replay,
)

project = "swarm-logistics-env"
author = project_copyright = "swarm-logistics-env contributors"
version = release = installed_version("swarm-logistics-env")
html_title = f"{project} {version}"

extensions = ["myst_parser", "sphinx_copybutton", "sphinxext.opengraph"]
# A command without its prompt; what it prints has no button.
copybutton_prompt_text = "$ "
copybutton_selector = "div:not(.highlight-text) > div.highlight > pre"
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
exclude_patterns = ["media", "releasing.md"]
html_theme = "furo"
# What a search engine and a link to a page show: its title, its first words and a picture.
ogp_site_url = os.environ.get("SITE_ADDRESS", "")  # the workflow of a release knows it
ogp_site_name = project
ogp_image = "_static/watch.png"
ogp_image_alt = "Two warehouses side by side, one with broken robots, and the deliveries of both"
ogp_social_cards = {"enable": False}
html_static_path = ["static", "media/watch.png"]
html_css_files = ["site.css"]
html_theme_options = {"navigation_with_keys": True}
html_math_renderer = "mathml"
html_copy_source = False
html_show_sphinx = False
pygments_style = "default"

# The pages in the order of the site's menu. They stand here, because GitHub would show a list of
# contents in a page as it is written.
CONTENTS = {
    "Begin": ("quickstart", "examples", "gallery", "notebook"),
    "Train": (
        "training",
        "The environment <environment>",
        "floors",
        "own",
        "models",
    ),
    "Judge": (
        "Judging <trials>",
        "indicators",
        "faults",
        "studies",
        "Other swarms <tasks>",
    ),
    "Robots": ("robots", "Controllers in C <c>", "bodies"),
    "What is known": (
        "results",
        "research/questions_of_the_field",
        "Published swarms <published>",
        "research/readings_and_tries",
        "research/paper_fit",
        "research/tuning",
    ),
    "Look up": (
        "Commands and files <reference>",
        "python",
        "versions",
        "What cannot be done <limits>",
        "Comparison <comparison>",
    ),
}


def setup(app: Sphinx) -> None:
    """Render formulas as MathML, which browsers draw themselves; add the contents."""
    app.connect("build-finished", record_replay)
    app.connect("source-read", add_contents)
    app.connect("source-read", add_site_parts)
    renderers = [(partial(formula, display), None) for display in ("inline", "block")]
    app.add_html_math_renderer("mathml", *renderers)


def add_contents(app: Sphinx, page: str, text: list[str]) -> None:
    """Put the list of all pages below the first one."""
    if page == "index":
        for caption, pages in CONTENTS.items():
            lines = "\n".join(pages)
            text[0] += f"\n```{{toctree}}\n:hidden:\n:caption: {caption}\n\n{lines}\n```\n"


def record_replay(app: Sphinx, error: Exception | None) -> None:
    """Record the run that plays on the site."""
    if error is None:
        write_replay(Path(app.outdir))


def add_site_parts(app: Sphinx, page: str, text: list[str]) -> None:
    """Put into a page what only the site has, and let links out of the pages lead somewhere."""
    text[0] = with_outside_links(with_example_links(text[0], page), page)
    if page == "notebook":
        notebook = notebook_markdown(ROOT / "examples" / "first_steps.ipynb")
        text[0] = text[0].replace("<!-- site: notebook -->", notebook)
    if page == "examples":
        text[0] = text[0].replace("<!-- site: examples -->", examples_markdown())
    if page == "gallery":
        text[0] = text[0].replace("<!-- site: replay -->", replay_frame())
    if page == "versions":
        text[0] += f"\n{versions_list()}\n"


def formula(display: str, translator: Any, node: Any) -> None:
    """Write a formula within a line (display "inline"), or on a line of its own ("block")."""
    markup: str = convert(node.astext(), display=display)
    # Without these, browsers set the bars of an absolute value apart as they do a relation.
    markup = markup.replace("<mo>&#x0007C;</mo>", '<mo lspace="0" rspace="0">&#x0007C;</mo>')
    translator.body.append(f'<div class="math">{markup}</div>\n' if display == "block" else markup)
    raise SkipNode
