"""The robot's end of a wire: parses what arrives, obeys it, and answers as the real one does."""
