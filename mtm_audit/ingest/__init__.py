"""Any recording into tracks: which reader and which tracker it takes."""
