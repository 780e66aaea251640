"""Lines of C: comments, declarations, and lines that are not too long."""

from __future__ import annotations

from swarm_logistics_env.robots.c_layout import (
    WIDTH,
    comment_lines,
    comments_of,
    declared,
    wrapped_lines,
)
from swarm_logistics_env.robots.c_values import FLOAT, INT, ArrayOf, TupleOf


def test_a_line_is_broken_where_it_can_be() -> None:
    word = "x" * WIDTH
    assert [*wrapped_lines(f"    {word}")] == [f"    {word}"]
    assert [*wrapped_lines(f"    function(a b, {word}")] == [
        "    function(a b,",
        f"{12 * ' '}{word}",
    ]
    assert [*wrapped_lines(f"    function(a {word}")] == ["    function(a", f"{12 * ' '}{word}"]
    just_fits = f"    {23 * 'abc '}abc;"
    assert [*wrapped_lines(just_fits)] == [just_fits]
    assert [*wrapped_lines(f"f({33 * 'abcd, '}x);")] == [
        f"f({15 * 'abcd, '}abcd,",
        f"{8 * ' '}{14 * 'abcd, '}abcd,",
        f"{8 * ' '}abcd, abcd, x);",
    ]


def test_comments_of_neighbouring_lines_are_one_and_those_for_tools_are_none() -> None:
    source = (
        "# fmt: off\nx = 1  # one\n# two\n#three\ny = 2\n\n# four\nz = '# no'  # type: ignore\n"
    )
    assert comments_of(source) == {2: "one two three", 7: "four"}


def test_a_comment_keeps_its_paragraphs_within_the_width() -> None:
    assert comment_lines("", "    ") == []
    assert comment_lines("Say `what`, not */.", "") == ["/* Say what, not * /. */"]
    words = 18 * "abcd " + "abc"
    assert comment_lines(words, "") == [f"/* {words} */"]
    assert comment_lines(f"One.\n\n{words}", "    ") == [
        "    /* One.",
        "     *",
        f"     * {17 * 'abcd '}abcd",
        "     * abc */",
    ]


def test_arrays_are_pointers_to_what_may_be_constant() -> None:
    array = ArrayOf(FLOAT, (4,))
    assert declared("x", array) == "float *x"
    assert declared("x", array, is_constant=True) == "const float *x"
    assert declared("x", INT, is_constant=True) == "int32_t x"
    assert declared("pair", TupleOf(FLOAT, 2)) == "floats2 pair"
