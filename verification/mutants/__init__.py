"""Faults made on purpose, as the lists (`*.toml`) state them, and the tests that catch each."""
