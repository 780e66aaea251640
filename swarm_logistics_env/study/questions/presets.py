"""The studies that come with the package, and published values: the paper's, and how near we come.

Source: Milner, Sooriyabandara and Hauert, Swarm Performance Indicators: Metrics for Robustness,
Fault Tolerance, Scalability and Adaptability; Tables I to III and the text around them.
"""

from __future__ import annotations

from pathlib import Path

from swarm_logistics_env.core.errors import StudyError, suggest

from .specification import Specification, read_study_file

_FOLDER = Path(__file__).parent / "preset_studies"
PRESETS = {path.stem: read_study_file(path) for path in sorted(_FOLDER.glob("*.toml"))}


def load_preset(name: str) -> Specification:
    """Return the preset study of that name.

    Raises:
        StudyError: there is none.
    """
    if name not in PRESETS:
        raise StudyError(f"no study preset {name!r}{suggest(name, PRESETS)}")
    return PRESETS[name]
