"""Faults made on purpose, one at a time in a copy of the tree, and the tests that catch each.

The lists (`*.toml`) state what would go wrong for a user, and the patch that makes it so.
"""
