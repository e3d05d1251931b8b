"""The commands of mtm-hil, one a file."""
