"""Checks of the promises in docs/promises.md: golden trajectories, invariants, mutants."""
