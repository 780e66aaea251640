"""Parts that the site alone has: links out of the pages, the notebook with outputs, a replay."""

import ast
import contextlib
import io
import json
import os
import re
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent.resolve()
ROOT = DOCS.parent
REPLAY = "replays/fm4.html"  # in the site
# Where files are that are no page; without it their names stand in the text.
REPOSITORY = os.environ.get("SITE_REPOSITORY", "")
# Folders of the site with former versions, newest first, e.g. "v1.1.0 v1.0.0".
VERSIONS = os.environ.get("SITE_VERSIONS", "").split()

_LINK = re.compile(r"(?<!!)\[([^\]]+)\]\(((?:\.\./)[^)#\s]*)(#[^)\s]*)?\)")


def with_outside_links(text: str, page: str) -> str:
    """Return a page whose links to files that are no pages lead to the repository, or nowhere.

    Args:
        page: its name without the ending, e.g. "research/tuning".
    """

    def of_the_site(match: re.Match[str]) -> str:
        words, target, anchor = match.groups()
        path = ((DOCS / page).parent / target).resolve()
        is_page = path.is_relative_to(DOCS) and path.suffix == ".md"
        is_file_to_load = path.suffix != ".md" and path.is_file()
        if is_page or is_file_to_load:
            return match[0]
        if REPOSITORY:
            return f"[{words}]({REPOSITORY}/blob/main/{path.relative_to(ROOT)}{anchor or ''})"
        name = str(path.relative_to(ROOT))
        return words if words.startswith("`") or words == name else f"{words} (`{name}`)"

    return _LINK.sub(of_the_site, text)


def notebook_markdown(path: Path) -> str:
    """Return a notebook as a page, each cell with what it prints and shows when it is run now."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    names: dict[str, Any] = {"__name__": "notebook"}
    parts = []
    for cell in cells:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(re.sub(r"^# ", "## ", source))
        else:
            parts += [f"```python\n{source}\n```", *cell_outputs(source, names)]
    return "\n\n".join(parts)


def cell_outputs(source: str, names: dict[str, Any]) -> list[str]:
    """Run a cell; return what it printed, and its value where the last line has one."""
    *statements, last = ast.parse(source).body
    value = None
    with contextlib.redirect_stdout(io.StringIO()) as out:
        if not isinstance(last, ast.Expr):
            statements.append(last)
        exec(compile(ast.Module(statements, []), "notebook", "exec"), names)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), "notebook", "eval"), names)
    outputs = [f"```text\n{out.getvalue()}```"] if out.getvalue() else []
    show = getattr(value, "_repr_html_", None)
    if show is not None:
        outputs.append(raw_html(show()))
    elif value is not None:
        outputs.append(f"```text\n{value!r}\n```")
    return outputs


def raw_html(text: str) -> str:
    """Return HTML as it stands in a page of the site."""
    return f"``````{{raw}} html\n{text}\n``````"


def write_replay(site: Path) -> None:
    """Record the run that the live view shows by a button, as a page that plays by itself."""
    from swarm_logistics_env import Scenario
    from swarm_logistics_env.views.watch import Session
    from swarm_logistics_env.views.watch.messages import recorded_page

    session = Session(Scenario())
    session.show_fault()
    file = site / REPLAY
    file.parent.mkdir(exist_ok=True)
    file.write_text(recorded_page(session, 240.0), encoding="utf-8")


def replay_frame() -> str:
    """Return the recorded run as a part of a page at the top of the site."""
    frame = f'<iframe class="replay" src="{REPLAY}" title="Two runs that play"></iframe>'
    return raw_html(f'{frame}\n<p><a href="{REPLAY}">The same on a page of its own</a></p>')


def versions_list() -> str:
    """Return the links to former versions of the site; "": there are none."""
    if not VERSIONS:
        return ""
    links = ", ".join(f'<a href="{name}/index.html">{name}</a>' for name in VERSIONS)
    return raw_html(f"<p>This site as it was with former versions: {links}.</p>")
