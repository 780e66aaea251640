"""The tables for a paper: numbers, captions and names, and that LaTeX takes them unedited."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from swarm_logistics_env.study.questions.comparison import Setting
from swarm_logistics_env.study.report.answer import answer
from swarm_logistics_env.study.report.document import document
from swarm_logistics_env.study.report.for_a_paper import HOLM, PaperTables, in_a_sentence
from swarm_logistics_env.study.report.latex import latex_tables
from swarm_logistics_env.study.report.section import Section
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.verdicts.results import StudyResults
from tests.conftest import Check
from tests.made_up import delivered, judged

HOSTILE = r"a_b & 50 % of \{x}^~#$ | <y> -- μ →"
PAGES = "article", "[twocolumn]{article}"
P = {"FM4": 8.0, "FM4_jam": 130.0, "delivery_width": 95.0}  # of 100 items


@pytest.fixture(scope="module")
def results() -> StudyResults:
    """Two policies of hostile names, with faults that cost much and little, and a parameter."""
    study = Study(
        name="lab_1",
        policies=[{"name": name, "label": f"{name} {HOSTILE}"} for name in ("homing", "swarm-dt")],
        scenario={"restock": True, "warehouse_width": 8.0},
        seeds=12,
        sizes=[{"values": [10, 25]}],
        faults=[{"modes": ["FM4", "FM4_jam"], "robots": [1, 2]}],
        parameters=[{"name": "delivery_width", "values": [2.0, 1.0]}],
    )

    def play(_: str, setting: Setting, seed: int) -> object:
        draw = np.random.default_rng([seed, *map(ord, str(setting))])
        mean = P.get(setting.name, 100.0) if setting.value else 100.0
        return delivered(draw.poisson(mean), digest=f"{setting} {seed}")

    return judged(study, play)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def latex(results: StudyResults) -> str:
    return latex_tables(document(results).paper)


def rows_of(latex: str, label: str) -> list[str]:
    """The rows of a table, without its heading."""
    table = latex.partition(rf"\label{{{label}}}")[2].partition(r"\bottomrule")[0]
    return table.partition(r"\midrule")[2].strip().splitlines()


def test_each_table_has_a_label_of_its_own_and_a_caption_that_can_stay(latex: str) -> None:
    labels = re.findall(r"\\label{(.*)}", latex)
    assert len(labels) == len(set(labels)) == latex.count(r"\end{tabular}") >= 7
    assert all(re.fullmatch("tab:[a-z0-9-]+", label) for label in labels)
    captions = re.findall(r"\\caption{(.*)}", latex)
    assert len(captions) == len(labels)
    for caption in captions:
        assert caption.startswith(("homing", "swarm-dt"))
        assert "P is the number of items delivered in the order requested. " in caption
        world = "a warehouse of 8 m x 10 m with 60 items that come back, robots of 2 m/s"
        assert f"World: {world}, 500 s; ${{N = 25}}$ unless said oth" in caption
        assert "12 paired seeds (0 to 11). 95\\,\\% intervals in brackets." in caption
        assert caption.endswith(
            "by Holm's method over all questions on an indicator of one policy."
        )
    titles = ("A b", "a: b", "c", "A B")
    tables = PaperTables("", tuple(Section(title, ("c",), (("x",),)) for title in titles), {})
    labels = re.findall(r"\\label{(.*)}", latex_tables(tables))
    assert labels == ["tab:a-b", "tab:a-b-2", "tab:c", "tab:a-b-3"]
    assert "continued" not in latex
    assert latex.startswith("% In the preamble: \\usepackage{booktabs}\n")


def test_minus_signs_are_minus_signs_and_points_stand_below_each_other(latex: str) -> None:
    assert not re.search(r"(?<![$}\w-])-\d", re.sub(r"\\label.*", "", latex))
    assert re.search(r"\$-0\.\d{3}\$ \[\$-0\.\d{3}\$, \$-0\.\d{3}\$\]", latex)
    label = next(text for text in re.findall(r"\\label{(.*)}", latex) if "robustness" in text)
    rows = rows_of(latex, label)
    assert len(rows) == 7
    assert all(row.count(" & ") == 3 for row in rows)
    for column in (1, 2):
        cells = [row.split(" & ")[column] for row in rows]
        shown = [re.sub(r"\\phantom{(.*?)}|[$]", r"\1", cell) for cell in cells if cell != "--"]
        assert len(shown) >= 4
        assert len({len(cell) for cell in shown}) == 1
        assert len({tuple(m.start() for m in re.finditer(r"\.", cell)) for cell in shown}) == 1


def test_names_are_those_that_a_reader_uses(latex: str) -> None:
    assert "A delivery width 2 to 1 m" in latex
    assert "delivery width = 1 m" in latex
    assert "Adaptability to delivery width." in latex
    assert "delivery_width" not in latex.replace("\\", "")
    name = (
        r"a\_b \& 50\,\% of \textbackslash{}\{x\}\textasciicircum{}\textasciitilde{}\#\$ "
        r"\textbar{} $<$y$>$ -{}- \texttt{U+03BC} $\to$"
    )
    assert f"homing {name}: Scalability." in latex
    assert f"{{homing {name}: indicators." in latex
    assert "\nS N 10 to 25 & " in latex
    about = PaperTables("P_F, P_N+m", (Section("t", ("c",), (("x",),)),), {})
    assert "t. $P_{\\mathrm{F}}$, $P_{\\mathrm{N+m}}$ " in latex_tables(about)


def test_a_row_that_is_open_beside_its_interval_says_why_in_a_paper_too() -> None:
    p = {0: [39, 44, 41, 36, 47, 40], 2: [33, 35, 36, 28, 41, 35]}  # by the number of robots failed
    faults = [{"modes": ["FM1"], "robots": [2]}]
    study = Study(policies=["homing"], seeds=6, faults=faults, indicators=["R"])
    few = judged(study, lambda _, setting, seed: delivered(p[int(setting.value)][seed]))
    latex = latex_tables(document(few).paper)
    (row,) = rows_of(latex, "tab:homing-indicators")
    assert row.endswith("open, stalls \\\\")
    assert "open, stalls: too few runs to rule out" in latex
    assert "and no more" not in latex  # which no row is
    words = "FM1 false timer, 2 of 25: P 41.2→34.7, R -0.08 [-0.12, -0.03], open, stalls. "
    assert words in in_a_sentence(few, answer(few))
    assert "xploratory" not in latex + in_a_sentence(few, answer(few))
    undeclared = replace(few, exploratory=True)
    words = "xploratory: over other seeds or P than were declared before the first run."
    assert latex_tables(document(undeclared).paper).count(f" E{words} ") == 2
    assert in_a_sentence(undeclared, answer(undeclared)).endswith(f"; e{words}")


@pytest.mark.parametrize("page", PAGES)
def test_latex_takes_the_tables_unedited(latex: str, page: str, tmp_path: Path) -> None:
    compiled(latex, page, tmp_path)


@pytest.mark.daily
def test_no_table_of_a_judged_policy_is_wider_than_the_page(tmp_path: Path) -> None:
    """Of the scorecard until it is clear, whose intervals have several levels."""
    study = Study.preset("scorecard", policies=["homing"], seeds=60, until_clear=True)

    def play(_: str, setting: Setting, seed: int) -> object:
        draw = np.random.default_rng([seed, *map(ord, str(setting))])
        return delivered(draw.poisson(30.0 + 0.3 * setting.value), digest=f"{setting} {seed}")

    results = judged(study, play)  # type: ignore[arg-type]
    latex = latex_tables(document(results).paper)
    # A letter stands behind an interval of another level than the heading has.
    assert re.search(r"\] ?\S* a & (supported|refuted|open)", latex)
    assert re.search(r"; a: interval of \$?9[\d.]+\$?\\,\\%", latex)
    for page in PAGES:
        assert "Overfull" not in compiled(latex, page, tmp_path)


def compiled(latex: str, page: str, tmp_path: Path) -> str:
    """Return what the compiler says of tables in a paper, or skip the test."""
    compiler = shutil.which("pdflatex") or shutil.which("tectonic")
    if compiler is None:
        pytest.skip("neither pdflatex nor tectonic is on the PATH")
    begin = rf"\documentclass{page if page[0] == '[' else f'{{{page}}}'}"
    (tmp_path / "tables.tex").write_text(latex)
    text = f"{begin}\n\\usepackage{{booktabs}}\n\\begin{{document}}\n\\input{{tables}}\n"
    (tmp_path / "paper.tex").write_text(f"{text}\\end{{document}}\n")
    options = ["-interaction=nonstopmode", "-halt-on-error"] * compiler.endswith("pdflatex")
    process = subprocess.run([compiler, *options, "paper.tex"], cwd=tmp_path, capture_output=True)
    printed = (process.stdout + process.stderr).decode(errors="replace")
    assert process.returncode == 0, printed[-2000:]
    assert (tmp_path / "paper.pdf").is_file()
    return printed


NARROW = Section(
    "A: P",
    ("N", "P [95 %]", "level"),
    (
        ("N = 5", "-1.25 [-10.5, ∞]†", "0.5 [0.25, 0.75] a"),
        ("[x]", "12 [3, 4.125]", "–"),
        ("* speed_1 1→2", "no run", "1 of 12 'so'"),
    ),
    ("Below α.", ""),
)


def test_a_table_is_written_letter_by_letter(check_recorded: Check) -> None:
    text = latex_tables(PaperTables("By P_F.", (NARROW,), {"speed_1": "speed [m/s]"}))
    check_recorded("odd_table.tex", text.splitlines())


@pytest.mark.parametrize(
    ("widths", "environment", "size", "layout"),
    [
        ((25, 15, 15), "table", "footnotesize}3", "lll"),
        ((26, 15, 15), "table*", "footnotesize}3", "lll"),
        ((42, 15, 15), "table*", "footnotesize}3", "lll"),
        ((43, 15, 15), "table*", "scriptsize}1.5", "lll"),
        ((25, 31), "table", "footnotesize}3", r"lp{0.16\linewidth}"),
        ((26, 30), "table", "footnotesize}3", "ll"),
    ],
)
def test_a_table_is_as_wide_and_small_as_its_letters_need(
    widths: tuple[int, ...], environment: str, size: str, layout: str
) -> None:
    table = Section("t", tuple("h" for _ in widths), (tuple("x" * width for width in widths),))
    lines = latex_tables(PaperTables("", (table,), {})).splitlines()[2:]
    name, separation = size.split("}")
    assert lines[0] == rf"\begin{{{environment}}}"
    assert lines[-1] == rf"\end{{{environment}}}"
    assert lines[5:8] == [
        rf"\{name}",
        rf"\setlength{{\tabcolsep}}{{{separation}pt}}",
        rf"\begin{{tabular}}{{@{{}}{layout}@{{}}}}",
    ]


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        (("q", "v"), ""),
        (("q", "P [95 %]"), "95\\,\\% intervals in brackets. "),
        (("P [95 %]", "R [95 %]"), "95\\,\\% intervals in brackets. "),
        (
            ("P [95 %]", "R [97.5 %]"),
            "Intervals in brackets, at the level in the heading or in the row. ",
        ),
    ],
)
def test_a_caption_says_the_level_of_intervals(columns: tuple[str, ...], words: str) -> None:
    table = Section("t", columns, (("x", "y"),))
    (caption,) = re.findall(r"\\caption{(.*)}", latex_tables(PaperTables("", (table,), {})))
    assert caption == f"t. {words}{HOLM}"
