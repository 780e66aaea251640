"""Checks of the promises in tests/README.md: golden trajectories, invariants, mutants."""
