"""What a survey found, as text, as JSON, and as a picture to read regions off."""
