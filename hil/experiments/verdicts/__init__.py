"""Whether verdicts keep their word: under keys nobody played, on strange vehicles, and how much they read."""
