"""Parts that the site alone has: examples, links out of its pages, the notebook, a replay."""

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
EXAMPLES = ROOT / "examples"
EXAMPLE_FOLDERS = (EXAMPLES, EXAMPLES / "questions", EXAMPLES / "tasks")
_LANGUAGES = {".c": "c", ".csv": "text", ".py": "python", ".toml": "toml"}  # of examples
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


def with_example_links(text: str, page: str) -> str:
    """Return a page whose examples, named as `examples/NAME` or linked, lead to the site's own.

    Args:
        page: its name without the ending, e.g. "research/tuning".
    """

    def of_the_site(match: re.Match[str]) -> str:
        words, target = match.groups()
        path = ((DOCS / page).parent / target).resolve()
        is_shown = path in EXAMPLE_FOLDERS or (
            path.parent in EXAMPLE_FOLDERS and path in example_files(path.parent)
        )
        return f"[{words}](#{example_label(path)})" if is_shown else match[0]

    prose_and_code = re.split(r"(^```.*?^```$)", text, flags=re.DOTALL | re.MULTILINE)
    to_root = os.path.relpath(ROOT, (DOCS / page).parent)
    for number, part in enumerate(prose_and_code):
        if not part.startswith("```"):
            linked = re.sub(r"(?<!\[)(`(examples/[\w/.]+)`)", rf"[\1]({to_root}/\2)", part)
            prose_and_code[number] = re.sub(r"\[([^\]]+)\]\(([^)#\s]*)\)", of_the_site, linked)
    return "".join(prose_and_code)


def example_files(folder: Path) -> list[Path]:
    """Return the examples in a folder that the site shows; the notebook has a page of its own."""
    return sorted(path for path in folder.iterdir() if path.suffix in _LANGUAGES)


def example_label(path: Path) -> str:
    """Return the label of an example on the site, e.g. "examples-wanderer-py"."""
    return re.sub(r"\W", "-", path.relative_to(ROOT).as_posix())


def examples_markdown() -> str:
    """Return all examples as a part of a page, each below its name, with a link to load it."""
    parts = []
    for folder in EXAMPLE_FOLDERS:
        parts.append(f"({example_label(folder)})=\n## {folder.relative_to(ROOT).as_posix()}")
        for path in example_files(folder):
            source = os.path.relpath(path, DOCS)
            parts += [
                f"({example_label(path)})=\n### {path.name}",
                f"{{download}}`load the file <{source}>`",
                f"```{{literalinclude}} {source}\n:language: {_LANGUAGES[path.suffix]}\n```",
            ]
    return "\n\n".join(parts)


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
