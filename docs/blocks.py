"""Runs the code of the pages and records what it prints: `python -m docs.blocks [PAGE ...]`.

The blocks of a page are run in their order, in one folder and one Python namespace:

    python    is executed; one whose first line is `# name.py` becomes that file as well
    toml      becomes the file that its first line names, `# name.toml`
    console   each `$ swarm-logistics ...`, `| head -N`, `| tail -N` and `|| echo WORDS` included
    text      directly below one of them: what it prints; recorded, and held by the tests
    sh        is not recorded; `python -m docs.blocks --small` runs it with few seeds and steps
"""

import contextlib
import io
import re
import shlex
import shutil
import sys
import tempfile
from collections.abc import Container, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from swarm_logistics_env.views.cli import app

DOCS = Path(__file__).parent
ROOT = DOCS.resolve().parent
LANGUAGES = {"python", "toml", "console", "text", "sh", ""}

_BLOCK = re.compile(r"^```(?P<language>[^\n]*)\n(?P<code>.*?)^```$", re.DOTALL | re.MULTILINE)
_FILE = re.compile(r"# (\w+\.(?:py|toml))\n")
# Lines about the machine rather than the result.
_WALL_TIME = re.compile(r"times real time|runs played|On one process| MB$")


class Block(NamedTuple):
    """A fenced block of a page."""

    language: str
    code: str


def pages() -> list[Path]:
    """Return the pages that have code."""
    return [page for page in sorted(DOCS.glob("*.md")) if blocks(page.read_text("utf-8"))]


def blocks(text: str) -> list[Block]:
    """Return the blocks of a page, in order, without directives of the site."""
    matches = _BLOCK.findall(text)
    return [Block(*match) for match in matches if not match[0].startswith("{")]


def record(text: str) -> str:
    """Run a page's blocks in a folder with `examples` alone; return it with what they printed."""
    names: dict[str, Any] = {"__name__": "page"}
    printed: str | None = None
    end = 0  # of the block before

    def with_output(match: re.Match[str]) -> str:
        nonlocal printed, end
        block = Block(*match.groups())
        between = text[end : match.start()]
        if block.language.startswith("{"):
            return match[0]
        end = match.end()
        output = printed
        printed = None if block.language == "text" else _output(block, names)
        is_output = block.language == "text" and output is not None and not between.strip()
        return f"```text\n{output}```" if is_output else match[0]

    with _working_folder() as folder:
        (folder / "examples").symlink_to(ROOT / "examples", target_is_directory=True)
        return _BLOCK.sub(with_output, text)


def normalise(text: str) -> str:
    """Return a page without what tells of the machine or of the version of the code.

    Digests are numbered as they appear, so that equal ones stay equal.
    """
    digests: dict[str, str] = {}
    text = re.sub(
        r"\b[0-9a-f]{64}\b", lambda m: digests.setdefault(m[0], f"digest {len(digests)}"), text
    )
    return "\n".join(
        re.sub(r"[\d.,]+", "#", line) if _WALL_TIME.search(line) else line
        for line in text.splitlines()
    )


def commands(text: str, languages: Container[str] = ("console", "sh")) -> list[list[str]]:
    """Return the arguments of every `swarm-logistics` command in blocks of these languages."""
    code = "\n".join(b.code for b in blocks(text) if b.language in languages)
    calls = re.findall(r"^(?:\$ )?swarm-logistics (.*)$", code.replace("\\\n", " "), re.MULTILINE)
    return [shlex.split(call.split(" |")[0], comments=True) for call in calls]


@contextlib.contextmanager
def _working_folder() -> Iterator[Path]:
    """Be in a new folder; find modules there, and forget those that came from it."""
    modules = set(sys.modules)
    path = list(sys.path)
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        folder = Path.cwd()
        sys.path.insert(0, str(folder))
        try:
            yield folder
        finally:
            sys.path[:] = path
            for module in set(sys.modules) - modules:
                file = getattr(sys.modules[module], "__file__", None)
                if file is not None and Path(file).is_relative_to(folder):
                    del sys.modules[module]


def _output(block: Block, names: dict[str, Any]) -> str | None:
    """Run a block, or write the file that it is; return what it prints, None: it runs nothing."""
    if file := _FILE.match(block.code):
        Path(file[1]).write_text(block.code, encoding="utf-8")
    if block.language == "python":
        with contextlib.redirect_stdout(io.StringIO()) as out:
            exec(compile(block.code, "page", "exec"), names)
        return out.getvalue()
    if block.language == "console":
        lines = block.code.splitlines()
        return "".join(_command_output(line[2:]) for line in lines if line.startswith("$ "))
    return None


def _command_output(line: str) -> str:
    call, _, on_failure = line.partition(" || echo ")
    call, _, pipe = call.partition(" | ")
    program, *arguments = shlex.split(call)
    assert program == "swarm-logistics", line
    if arguments[:2] == ["study", "run"] and "--engine" not in arguments:
        arguments += ["--engine", "local"]  # the same bits, without the start of processes
    out = io.StringIO()
    errors = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(errors):
        code = app.run(arguments)
    printed = out.getvalue() + (errors.getvalue() if code else "")
    if code and not on_failure:
        raise AssertionError(f"{line}: ended with {code}: {printed}")
    if pipe:
        program, number = pipe.split()
        lines = printed.splitlines(keepends=True)
        shown = int(number[1:])
        printed = "".join({"head": lines[:shown], "tail": lines[-shown:]}[program])
    return printed + (" ".join(shlex.split(on_failure)) + "\n" if code else "")


# What makes a command small; of an option that is given twice the last one counts.
SMALL = {
    "judge": ["--seeds", "3", "--all-seeds"],
    "study": ["--seeds", "1"],
    "train": ["--steps", "1"],
}


def run_in_small(texts: Mapping[str, str]) -> None:
    """Run the shell commands of the pages one after another in a folder with all their files.

    Not run is what serves a page until somebody stops it, and what takes other numbers of seeds.
    Python is run where it names what a command of its page reads.
    """
    with _working_folder() as folder:
        for path in (ROOT / "examples").iterdir():
            if path.suffix in (".py", ".c"):
                shutil.copy(path, folder)
        for block in (block for text in texts.values() for block in blocks(text)):
            if file := _FILE.match(block.code):
                (folder / file[1]).write_text(block.code, encoding="utf-8")
        for name, text in texts.items():
            page_commands = commands(text, ("sh", ""))
            words = {f'"{word}"' for arguments in page_commands for word in arguments}
            python = [block for block in blocks(text) if block.language == "python"]
            if any(word in block.code for block in python for word in words):
                names: dict[str, Any] = {"__name__": "page"}
                for block in python:
                    _output(block, names)
            for arguments in page_commands:
                command = f"{name}: swarm-logistics {shlex.join(arguments)}"
                is_served = arguments[0] == "watch" and "--save" not in arguments
                if is_served or {"--until-clear", "--shard"} & set(arguments):
                    print(f"{command}: is not run", flush=True)
                    continue
                print(command, flush=True)
                if app.run([*arguments, *SMALL.get(arguments[0], [])]):
                    raise SystemExit(f"{command} failed")


if __name__ == "__main__":
    if sys.argv[1:] == ["--small"]:
        run_in_small(
            {page.name: page.read_text("utf-8") for page in [*pages(), ROOT / "README.md"]}
        )
        raise SystemExit
    for page in [Path(name) for name in sys.argv[1:]] or pages():
        text = page.read_text(encoding="utf-8")
        current = record(text)
        if normalise(current) != normalise(text):
            page.write_text(current, encoding="utf-8")
            print(f"{page}: recorded anew")
