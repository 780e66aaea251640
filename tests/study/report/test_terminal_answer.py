"""The answer as a terminal shows it: folded sentences, and rows in columns."""

from __future__ import annotations

import pytest

from swarm_logistics_env.study import Study
from swarm_logistics_env.study.questions.comparison import Setting
from swarm_logistics_env.study.report.answer import answer
from swarm_logistics_env.study.report.terminal_answer import terminal_answer
from swarm_logistics_env.study.tasks.outcome import Outcome
from tests.made_up import delivered, judged

P = {"homing": [6, 7, 9, 11], "swarm-dt": [8, 11, 12, 10], "random-walk": [1, 2, 1, 3]}

OF_ONE = """\
None of 2 questions is decided.
homing: P [95 %] = 33.0 [18.9, 47.1]
  items in 500 s, N = 25, no fault; 4
  paired seeds (0 to 3).
Robustness R: 1 open, 1 untestable;
  lowest at FM1 false timer, 1 of 25: P
  33→31.5, R -0.01 [-0.05, 0.04], open.
                            value  95 % interval  verdict
R FM1 false timer, 1 of 25  -0.01  [-0.05, 0.04]  open
R FM4 no delivery, 1 of 25   0.04                 untestable, equal P
R = P with m of N faulty / P of all
  sound - (1 - m/N); 0: P falls by the
  share m/N, m/N: not at all.
open, and no more: neither an effect is
  shown nor that there is none.
untestable, equal P: nearly all pairs of
  runs have the same P.
Verdicts are by Holm's method over all
  questions on an indicator of one
  policy.
1 open: 10 new seeds might decide it.
A faulty robot: FM1: always tells timer
  0, as if it were in the delivery area,
  so that others follow it; FM4:
  delivers nothing when it enters the
  delivery area."""

OF_TWO = """\
None of 4 questions is decided.
study: 4 questions, 2 policies, 4 paired
  seeds.
homing: P [95 %] = 33.0 [18.9, 47.1]
  items in 500 s, N = 25, no fault.
Robustness R: 1 open, 1 untestable;
  lowest at FM1 false timer, 1 of 25: P
  33→31.5, R -0.01 [-0.05, 0.04], open.
swarm-dt: P [95 %] = 41.0 [30.1, 51.9]
  items in 500 s, N = 25, no fault.
Robustness R: 1 open, 1 untestable;
  lowest at FM1 false timer, 1 of 25: P
  41→39.5, R 0.003 [-0.04, 0.05], open.
          value  95 % interval  verdict
homing:
R F…1/25  -0.01  [-0.05, 0.04]  open
R F…1/25   0.04                 untestable, equal P
swarm-dt:
R F…1/25  0.003  [-0.04, 0.05]  open
R F…1/25   0.04                 untestable, equal P
R = P with m of N faulty / P of all
  sound - (1 - m/N); 0: P falls by the
  share m/N, m/N: not at all.
open, and no more: neither an effect is
  shown nor that there is none.
untestable, equal P: nearly all pairs of
  runs have the same P.
Verdicts are by Holm's method over all
  questions on an indicator of one
  policy.
2 open: 10 new seeds might decide them.
A faulty robot: FM1: always tells timer
  0, as if it were in the delivery area,
  so that others follow it; FM4:
  delivers nothing when it enters the
  delivery area."""

OF_THREE = """\
study: 12 questions, 3 policies, 4 paired seeds.
[95 %]      P, N = 25, no fault  times the first
homing      33.0 [18.9, 47.1]
swarm-dt    41.0 [30.1, 51.9]    1.24 [0.81, 1.91]  open
rand…-walk  7.0 [0.9, 13.1]      0.21 [0.09, 0.46]  less
In 4 comparisons under other conditions no order is
  shown to turn.
Robustness R: 3 open, 3 untestable; lowest at
  random-walk: FM1 false timer, 1 of 25: P 7→5.5, R
  -0.17 [-0.37, 0.09], open.
               value  95 % interval  verdict
homing against swarm-dt:
times…o fault   0.80  [0.52, 1.23]   open
times…1 m = 1   0.80  [0.51, 1.23]   open
times…4 m = 1   0.80  [0.52, 1.23]   open
homing against random-walk:
times…o fault   4.71  [2.18, 10.66]  more, n < 10
times…1 m = 1   5.73  [2.08, 16.90]  more, n < 10
times…4 m = 1   4.71  [2.18, 10.66]  more, n < 10
homing:
R FM1…er 1/25  -0.01  [-0.05, 0.04]  open
R FM4…ry 1/25   0.04                 untestable, equal P
swarm-dt:
R FM1…er 1/25  0.003  [-0.04, 0.05]  open
R FM4…ry 1/25   0.04                 untestable, equal P
random-walk:
R FM1…er 1/25  -0.17  [-0.37, 0.09]  open
R FM4…ry 1/25   0.04                 untestable, equal P
R = P with m of N faulty / P of all sound - (1 - m/N);
  0: P falls by the share m/N, m/N: not at all.
times P: P of the policy before 'against' / P of the
  other.
more, less: of P than the policy behind 'against'.
open, and no more: neither an effect is shown nor that
  there is none.
n < 10: provisional.
untestable, equal P: nearly all pairs of runs have the
  same P.
Verdicts are by Holm's method over all questions on an
  indicator of one policy.
6 open: 90 new seeds might decide them.
A faulty robot: FM1: always tells timer 0, as if it were
  in the delivery area, so that others follow it; FM4:
  delivers nothing when it enters the delivery area."""


def play(policy: str, setting: Setting, seed: int) -> Outcome:
    """Play a run: FM1 costs an item more at each next seed, FM4 none."""
    count = 4 * P[policy][seed] - seed * (setting.name == "FM1")
    return delivered(count, digest=f"{policy} {setting} {seed}")


@pytest.mark.parametrize(
    ("n_policies", "width", "shortens", "text"),
    [(1, 40, False, OF_ONE), (2, 40, True, OF_TWO), (3, 56, True, OF_THREE)],
)
def test_sentences_are_folded_and_rows_stand_in_columns(
    n_policies: int, width: int, shortens: bool, text: str
) -> None:
    study = Study(
        policies=[*P][:n_policies], seeds=4, faults=[{"modes": ["FM1", "FM4"], "robots": [1]}],
        indicators=["R"], compares_policies=n_policies > 2,
    )  # fmt: skip
    shown = terminal_answer(answer(judged(study, play)), width, shortens=shortens)
    assert shown.splitlines() == text.splitlines()
