"""The view in the browser: a server for one session, and recordings that need none."""

from .recording import Recording, recorded_page
from .server import WatchServer, serve

__all__ = ["Recording", "WatchServer", "recorded_page", "serve"]
