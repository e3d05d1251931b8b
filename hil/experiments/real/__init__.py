"""Messages added to recorded motion: what a decode makes of real interference."""
