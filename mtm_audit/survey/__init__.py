"""What is in a recording, without a key: markers, colours, motion, times, and the options that suit it."""
