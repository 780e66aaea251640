"""Lines of C that are not too long."""

from __future__ import annotations

from swarm_logistics_env.robots.c_layout import WIDTH, wrapped_lines


def test_a_line_is_broken_where_it_can_be() -> None:
    word = "x" * WIDTH
    assert [*wrapped_lines(f"    {word}")] == [f"    {word}"]
    assert [*wrapped_lines(f"    function(a b, {word}")] == [
        "    function(a b,",
        f"{12 * ' '}{word}",
    ]
    assert [*wrapped_lines(f"    function(a {word}")] == ["    function(a", f"{12 * ' '}{word}"]
