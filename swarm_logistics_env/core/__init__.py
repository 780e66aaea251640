"""What every room uses: errors, records, random streams, users' code and its identity."""
