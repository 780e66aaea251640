"""Settings for all tests: how hard hypothesis searches."""

from __future__ import annotations

import os

from hypothesis import settings

# Derandomized: the gate gives the same answer twice. No deadline: a time would test the machine.
settings.register_profile("default", max_examples=200, derandomize=True, deadline=None)
settings.register_profile("nightly", max_examples=2000, deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "default"))
