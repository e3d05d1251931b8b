"""Watching a source while it lasts: what it shows, when it is looked at, what a look costs, and who is told."""
