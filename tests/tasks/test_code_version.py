from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from swarm_logistics_env.episode import Play
from swarm_logistics_env.policies.policy import modules_used, without_prose
from swarm_logistics_env.warehouse import Warehouse


def test_prose_does_not_count() -> None:
    bare = "def f(x: int) -> int:\n    return x  # kept\nclass A:\n    b = '''text\n# inside'''\n"
    told = (
        '"""Module."""\n\n# why\ndef f(x: int) -> int:\n    """Tell.\n\n    More.\n    """\n\n'
        "    return x  # kept\nclass A:\n    # note\n    b = '''text\n# inside'''\n"
    )
    assert without_prose(told) == without_prose(bare)
    assert without_prose(bare.replace("x  #", "x + 1  #")) != without_prose(bare)


def test_covers_all_that_an_episode_loads() -> None:
    """A module that decides what a run gives must make stored runs stale when it changes."""
    script = (
        "import sys, swarm_logistics_env.episode as e; "
        "print(*(m.__file__ for n, m in sys.modules.items() "
        "if n.startswith('swarm_logistics_env.')), sep='\\n')"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    package = Path(sys.modules["swarm_logistics_env"].__file__ or "").parent
    loaded = {Path(line).relative_to(package).as_posix() for line in done.stdout.split()}
    used = modules_used(Play, Warehouse).values()
    covered = {path.relative_to(package).as_posix() for path in used}
    # Policies have identities of their own; these hold messages, validation and names only.
    others = {name for name in loaded - covered if name.split("/")[0] not in ("motion", "policies")}
    assert others <= {
        "errors.py", "records.py", "environment/__init__.py", "environment/registration.py"
    }  # fmt: skip
    assert {"warehouse/physics.py", "policies/policy.py", "kernels.py"} <= covered <= loaded
