"""Robot links, one a file, all behind `base.Link`."""
