"""Who is to blame for a loss, and which fault costs most."""
