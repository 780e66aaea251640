"""Makes the README's links absolute, and names the repository in pyproject.toml, for a release.

A package index shows the README on a page of its own, where relative links and pictures lead
nowhere. The repository's address is known where it is hosted, so the release passes it.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

RELATIVE = re.compile(r"^(\[[^\]]+\]: )(?!https?://|#)(\S+)$", re.MULTILINE)


def main() -> None:
    """Rewrite both files in place."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("repository", help="its address, as https://HOST/OWNER/NAME")
    parser.add_argument("tag", help="of the release")
    parser.add_argument("--root", type=Path, default=Path(__file__).parents[1])
    given = parser.parse_args()
    readme, project = given.root / "README.md", given.root / "pyproject.toml"

    def absolute(link: re.Match[str]) -> str:
        # The page that shows a picture is no picture.
        kind = "raw" if Path(link[2]).suffix in {".gif", ".png"} else "blob"
        return f"{link[1]}{given.repository}/{kind}/{given.tag}/{link[2]}"

    text = RELATIVE.sub(absolute, readme.read_text(encoding="utf-8"))
    readme.write_text(text, encoding="utf-8")
    head = "[project.urls]\n"
    urls = "".join(
        f'{name} = "{given.repository}{path}"\n'
        for name, path in (
            ("Source", ""),
            ("Issues", "/issues"),
            ("Changelog", f"/blob/{given.tag}/CHANGELOG.md"),
            ("Documentation", f"/tree/{given.tag}/docs"),
        )
    )
    text = project.read_text(encoding="utf-8")
    project.write_text(text.replace(head, head + urls, 1), encoding="utf-8")


if __name__ == "__main__":
    main()
