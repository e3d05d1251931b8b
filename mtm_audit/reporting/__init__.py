"""A decoding in words, in JSON and in pictures."""
