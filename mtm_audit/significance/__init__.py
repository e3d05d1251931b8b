"""What scores are worth: how often chance alone would show as much."""
