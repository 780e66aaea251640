"""Third parties' code, unchanged, on this environment: see README.md here."""
