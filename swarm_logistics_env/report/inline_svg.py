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
    return _text(_for_page(svg, name, titles))


def forest_rows(svg: str, links: Sequence[Sequence[tuple[str, str]]]) -> list[str]:
    """Return each row of a forest (`drawing.forest`) as an element of the page.

    Args:
        svg: the forest.
        links: for each row the ids of its marks, each with the class that colours it.
    """
    root = _for_page(svg, "forest", {})
    left, top, right, bottom = _frame(root)
    height = (bottom - top) / (len(links) + 0.2)  # 0.1 of a row above the first, and below the last
    zero = _text(next(root.iterfind(".//g[@data-mark='zero']")))
    marks: dict[str, list[Element]] = {}
    for group in root.iterfind(".//g[@data-question]"):
        marks.setdefault(f"question-{group.get('data-question')}", []).append(group)
    rows = []
    for row, row_links in enumerate(links):
        groups = "".join(
            f'<g class="{css_class}">{"".join(map(_text, marks[link]))}</g>'
            for link, css_class in row_links
            if link in marks
        )
        y = top + (row + 0.1) * height
        box = f"{left:.2f} {y:.2f} {right - left:.2f} {height:.2f}"
        # The colour is that of the verdict, not of the policy.
        groups = re.sub(r"var\(--p\d\)", "var(--c)", groups)
        row_svg = f'<svg viewBox="{box}" preserveAspectRatio="none" aria-hidden="true">'
        # What lies outside of the row is not shown, and the clip path of the axes is not here.
        rows.append(row_svg + re.sub(' clip-path="[^"]*"', "", zero + groups) + "</svg>")
    return rows


def _frame(root: Element) -> tuple[float, float, float, float]:
    """Return left, top, right and bottom of the axes."""
    path = next(root.iterfind(".//g[@data-mark='frame']/path"))
    numbers = [float(number) for number in re.findall(r"-?[\d.]+", path.get("d", ""))]
    xs, ys = numbers[0::2], numbers[1::2]
    return min(xs), min(ys), max(xs), max(ys)


def _for_page(svg: str, name: str, titles: Mapping[str, str]) -> Element:
    """Return the tree of a drawing, as `inline` describes it."""
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
    return root


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
    elif identity in ("zero", "frame"):
        element.set("data-mark", identity)
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


def _text(element: Element) -> str:
    return ElementTree.tostring(element, encoding="unicode")
