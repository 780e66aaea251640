"""Pictures of the warehouse. pygame is loaded only when a `Renderer` is made."""

from .renderer import Renderer, RenderMode

__all__ = ["RenderMode", "Renderer"]
