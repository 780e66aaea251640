"""Outputs as classes: every class is an output, and every output has a nearest class."""

from __future__ import annotations

import numpy as np

from swarm_logistics_env.core.streams import row_keys
from swarm_logistics_env.policies.network_steps import choose_outputs
from swarm_logistics_env.world.motion.classes import GROUPS, N_CLASSES, classes_of, outputs_of


def test_every_class_is_the_nearest_one_of_its_own_outputs() -> None:
    every = np.stack(np.meshgrid(*map(np.arange, GROUPS), indexing="ij"), -1).reshape(-1, 3)
    moves = every[:, 1] > 0  # who stands has no direction
    outputs = outputs_of(every)
    np.testing.assert_array_equal(classes_of(outputs)[moves], every[moves])
    np.testing.assert_array_equal(classes_of(outputs)[:, 1:], every[:, 1:])
    np.testing.assert_allclose(outputs_of(np.array([[8, 4, 0]])), [[0, 1, -1]], atol=1e-7)
    far = np.array([[-3.0, 0.1, 2.0]])  # beyond what there is to command
    assert classes_of(far).tolist() == [[16, 4, 2]]


def test_classes_are_drawn_as_often_as_their_logits_say() -> None:
    n = 20_000
    logits = np.tile(
        np.random.default_rng(0).normal(0.0, 1.0, N_CLASSES).astype(np.float32), (n, 1)
    )
    counts, outputs = np.full(n, 5), np.empty((n, 3), np.float32)
    for temperature in (0.5, 2.0):
        choose_outputs(row_keys(0, "draws", n), counts, temperature, logits, outputs)
        drawn = classes_of(outputs)
        moves = drawn[:, 1] > 0
        first = 0
        for column, n_classes in enumerate(GROUPS):
            weights = np.exp(logits[0, first : first + n_classes].astype(float) / temperature)
            shares = np.bincount(drawn[moves if column == 0 else slice(None), column]) / (
                moves.sum() if column == 0 else n
            )
            np.testing.assert_allclose(shares, weights / weights.sum(), atol=0.02)
            first += n_classes
    choose_outputs(row_keys(0, "draws", n), counts, 0.0, logits, outputs)
    parts = np.split(logits[0], np.cumsum(GROUPS)[:-1])
    likeliest = outputs_of(np.array([[part.argmax() for part in parts]]))
    np.testing.assert_array_equal(outputs, np.tile(likeliest, (n, 1)))
