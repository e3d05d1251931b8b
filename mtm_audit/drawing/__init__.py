"""Drawing on pictures of a film: what was seen in them, grids of pixel numbers, contact sheets, films."""
