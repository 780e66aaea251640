"""Drawings as parts of the page: in the page's colours, and each mark names what a click shows.

The drawings are those of `drawing.py`, as SVG; nothing is drawn here.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from .drawing import COLOURS, INK, PAPER

# Ids of marks, see `Point.link`: a question or a condition, and the seeds of its dots.
_LINK = re.compile(r"(question|condition)-(\d+)(?:-seeds-([\d-]+))?")
_VARIABLES = {
    INK: "var(--ink)",
    PAPER: "var(--paper)",
    **{colour: f"var(--p{style})" for style, colour in enumerate(COLOURS)},
}
_COLOUR = re.compile("|".join(_VARIABLES))
_NUMBER = re.compile(r"-?\d+\.\d+")


def inline(svg: str, name: str, titles: Mapping[str, str]) -> str:
    """Return a drawing as an element of the page.

    Args:
        svg: the drawing.
        name: begins its ids, which have to differ from those of other drawings of the page.
        titles: what is shown beside the pointer, by the id of a mark.
    """
    root = ElementTree.fromstring(svg)
    for style in root.iterfind(".//{*}style/.."):  # it would hold for the whole page
        for child in style.findall("{*}style"):
            style.remove(child)
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]
        for attribute, value in list(element.attrib.items()):
            del element.attrib[attribute]
            element.set(attribute.rpartition("}")[2], _for_attribute(value))
        element.text = (element.text or "").strip()
        element.tail = ""
        if element.get("transform", "").startswith("rotate(-0 "):
            del element.attrib["transform"]
        _name(element, name, titles)
    # A marker has the colours of the place that uses it.
    for marker in root.iterfind(".//defs/path"):
        marker.attrib.pop("style", None)
    for size in ("width", "height", "version"):
        root.attrib.pop(size, None)
    root.set("stroke-linejoin", "round")
    return ElementTree.tostring(root, encoding="unicode")


def _for_attribute(value: str) -> str:
    """Return an attribute's value in the page's colours and letters, its numbers rounded."""
    value = re.sub(r"\s+", " ", value.strip())
    value = _COLOUR.sub(lambda match: _VARIABLES[match[0]], value)
    value = re.sub("font-family: [^;]*;? ?", "", value)
    return _NUMBER.sub(lambda match: f"{float(match[0]):.2f}".rstrip("0").rstrip("."), value)


def _name(element: Element, name: str, titles: Mapping[str, str]) -> None:
    """Turn the id of a mark into what the page's script reads, and let other ids differ."""
    for attribute in ("href", "clip-path"):
        value = element.get(attribute, "")
        if "#" in value:
            element.set(attribute, value.replace("#", f"#{name}-"))
    identity = element.attrib.pop("id", "")
    link = _LINK.fullmatch(identity)
    if link:
        kind, number, seeds = link.groups()
        element.set(f"data-{kind}", number)
        if seeds:
            _name_dots(element, seeds.split("-"))
    elif element.tag != "g" and identity:
        element.set("id", f"{name}-{identity}")
    if identity in titles:
        title = ElementTree.SubElement(element, "title")
        title.text = titles[identity]


def _name_dots(element: Element, seeds: Sequence[str]) -> None:
    """Let each dot name its seed; the page's style says how they look, but for their colour."""
    for dot, seed in zip(element.iterfind(".//{*}use"), seeds, strict=True):
        style = dot.attrib.pop("style")
        element.set("style", _for_attribute(style.partition(";")[0]))
        dot.set("class", "dot")
        dot.set("data-seed", seed)
