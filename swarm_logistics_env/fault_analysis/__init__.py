"""Which fault costs most."""
