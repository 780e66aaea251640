"""Rows are normalized as they were in training, by pairs, functions and statistics."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import policies
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.world.observations import N_COLUMNS

MEAN, DEVIATION = np.full(N_COLUMNS, 2.0), np.full(N_COLUMNS, 4.0)


def first_columns(rows: Any) -> Any:
    return rows[:, :4]


def vec_normalize(**attributes: Any) -> SimpleNamespace:
    """Return what a VecNormalize has, as read from a file: no environment."""
    statistics = SimpleNamespace(mean=MEAN, var=DEVIATION**2 - 1.0)
    defaults = {"norm_obs": True, "obs_rms": statistics, "epsilon": 1.0, "clip_obs": 10.0}
    return SimpleNamespace(**defaults | attributes)


@pytest.mark.parametrize(
    ("normalize", "expected"),
    [
        ((MEAN, DEVIATION), 1.0),
        ((MEAN[None], 4.0), 1.0),
        ([MEAN, DEVIATION], 1.0),
        (SimpleNamespace(mean=MEAN, var=DEVIATION**2), 1.0),  # statistics alone
        (lambda rows: (rows - 2.0) / 4.0, 1.0),
        (vec_normalize(), 1.0),
        (vec_normalize(clip_obs=0.5), 0.5),
        (vec_normalize(norm_obs=False), 6.0),
        (SimpleNamespace(norm_obs=False), 6.0),  # it has no statistics, if made so
        (SimpleNamespace(venv=vec_normalize(clip_obs=0.5)), 0.5),
    ],
)
def test_rows_are_normalized_as_they_were_in_training(normalize: Any, expected: float) -> None:
    policy = policies.of(first_columns, normalize=normalize)
    assert (policy.act(np.full((2, N_COLUMNS), 6.0, np.float32)) == expected).all()


def test_statistics_without_a_variance_have_a_little_of_one() -> None:
    still = SimpleNamespace(mean=0.0, var=0.0)
    policy = policies.of(first_columns, normalize=still)
    commands = policy.act(np.full((2, N_COLUMNS), 5e-5, np.float32))
    np.testing.assert_allclose(commands, 0.5, rtol=1e-6)


def test_rows_of_zeros_stay_zeros_and_statistics_go_on_with_their_training() -> None:
    normalize = vec_normalize()
    policy = policies.of(first_columns, normalize=normalize)
    assert (policy.act(np.zeros((2, N_COLUMNS), np.float32)) == 0.0).all()
    normalize.obs_rms.mean = np.full(N_COLUMNS, 6.0)
    assert (policy.act(np.full((2, N_COLUMNS), 6.0, np.float32)) == 0.0).all()
    sentence = r"its statistics have shape \(141,\), and rows here \(143,\): should be of the rows"
    with pytest.raises(PolicyError, match=sentence):
        policy.act(np.full((2, N_COLUMNS + 2), 6.0, np.float32))


def test_a_policy_is_known_by_its_statistics_and_their_limit() -> None:
    normalizers = [None, vec_normalize(), vec_normalize(clip_obs=5.0), vec_normalize(epsilon=2.0)]
    identities = [policies.identity(policies.of(first_columns, normalize=n)) for n in normalizers]
    assert len(set(identities)) == len(identities)
    off = policies.of(first_columns, normalize=vec_normalize(norm_obs=False))
    assert policies.identity(off) == identities[0]


@pytest.mark.parametrize(
    ("normalize", "options", "sentence"),
    [
        ((np.zeros(95), np.ones(95)), {}, r"shape \(95,\), and rows here \(141,\)"),
        ((MEAN, DEVIATION), {"frame": True}, r"shape \(141,\), and rows here \(95,\)"),
        ((MEAN, np.ones(3)), {}, r"mean has shape \(141,\) and its deviation \(3,\)"),
        ((MEAN, np.zeros(N_COLUMNS)), {}, "should have a finite mean and a deviation above zero"),
        (("a", "b"), {}, "should be arrays of numbers, mean and standard deviation"),
        (
            (np.zeros((2, N_COLUMNS)), 1.0),
            {},
            r"mean has shape \(2, 141\) and its deviation \(\): ",
        ),
        *(
            (wrong, {}, r"(?s)^normalize = .*: should be None, a function of rows, a pair \(mean, ")
            for wrong in (3, (MEAN, DEVIATION, MEAN), np.ones((2, N_COLUMNS)), SimpleNamespace)
        ),
        (
            vec_normalize(obs_rms={"seen": None, "goal": None}),
            {},
            "is of observations in several parts, seen, goal: should be of rows",
        ),
    ],
)
def test_statistics_of_other_rows_are_refused(normalize: Any, options: Any, sentence: str) -> None:
    with pytest.raises(PolicyError, match=sentence):
        policies.of(first_columns, normalize=normalize, **options)
