"""A session in the browser: a server on this machine's loopback, one page, no other resource."""

from swarm_logistics_env.watch.web.server import WatchServer, serve

__all__ = ["WatchServer", "serve"]
