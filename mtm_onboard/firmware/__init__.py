"""What a microcontroller plays: images made from a key."""
