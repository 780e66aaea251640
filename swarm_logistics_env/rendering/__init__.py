"""Pictures of the warehouse. pygame is loaded only when a `Renderer` is made."""

from swarm_logistics_env.rendering.renderer import Renderer, RenderMode

__all__ = ["RenderMode", "Renderer"]
