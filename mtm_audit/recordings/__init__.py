"""Reading recordings: video into frames, motion capture into tracks."""
