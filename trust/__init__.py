"""What holds the promises of docs/promises.md: recorded trajectories, invariants, mutants."""
