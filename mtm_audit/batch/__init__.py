"""Many recordings under several keys: found, read in other processes, and told in one table."""
