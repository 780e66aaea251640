"""The view in the browser: a server for one session, and recordings that need none."""

from swarm_logistics_env.watch.web.recording import Recording, recorded_page
from swarm_logistics_env.watch.web.server import WatchServer, serve

__all__ = ["Recording", "WatchServer", "recorded_page", "serve"]
