"""Questions: from a specification to the conditions and comparisons that it needs."""
