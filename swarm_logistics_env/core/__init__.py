"""What all rooms use and none is about: errors, records, random streams, users' code and its identity."""
