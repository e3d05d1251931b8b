"""The commands of mtm-audit, one a file."""
