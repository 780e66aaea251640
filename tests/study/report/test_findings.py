"""What a study found, in a session and in a notebook's cell."""

from __future__ import annotations

from pathlib import Path

from swarm_logistics_env.study.report.answer import answer
from swarm_logistics_env.study.report.findings import html_table
from swarm_logistics_env.study.report.section import Section
from swarm_logistics_env.study.report.terminal_answer import terminal_answer
from swarm_logistics_env.study.trial_study import judge

TABLE = "policy,robots,P\n" + "".join(
    f"<b>,{robots},{2 * robots + trial % 3}\n" for robots in (5, 10, 20) for trial in range(12)
)


def test_results_say_their_answer(tmp_path: Path) -> None:
    (tmp_path / "mine.csv").write_text(TABLE)
    results = judge(tmp_path / "mine.csv")
    title, _, rest = repr(results).partition("\n")
    assert title == "Results of the study 'mine'"
    assert rest == terminal_answer(answer(results))
    html = results._repr_html_()
    questions = answer(results).section.rows
    assert len(questions) == 2
    assert html.count("<tr>") == 1 + len(questions)
    assert "&lt;b&gt;: P" in html
    assert "<b>" not in html
    for sentence in (*answer(results).opening, *answer(results).summary):
        assert f"<p>{sentence.replace('<', '&lt;').replace('>', '&gt;')}</p>" in html


def test_three_policies_have_their_overview_above_the_questions(tmp_path: Path) -> None:
    rows = [line for name in "abc" for line in TABLE.replace("<b>", name).splitlines()[1:]]
    (tmp_path / "mine.csv").write_text("\n".join(["policy,robots,P", *rows]))
    results = judge(tmp_path / "mine.csv")
    overview = answer(results).overview
    assert overview is not None
    head, _, rest = results._repr_html_().partition(html_table(overview))
    assert "<table" not in head
    assert html_table(answer(results).section) in rest


def test_a_table_keeps_its_columns_and_leaves_out_empty_lines() -> None:
    rows = (("1", "<2>"), ("3", "4"))
    assert html_table(Section("title", ("a & b", "c"), rows, ("below", "", "<x>"))) == (
        "<table><thead><tr><th style='text-align: left'>a &amp; b</th>"
        "<th style='text-align: left'>c</th></tr></thead><tbody>"
        "<tr><td style='text-align: left'>1</td><td style='text-align: left'>&lt;2&gt;</td>"
        "<tr><td style='text-align: left'>3</td><td style='text-align: left'>4</td>"
        "</tbody></table><p>below</p><p>&lt;x&gt;</p>"
    )
