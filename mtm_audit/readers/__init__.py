"""Files into pictures or tracks; a reader knows nothing of tracking."""
