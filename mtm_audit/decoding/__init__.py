"""From tracks to a decoding: association, start, symbols, message, verdict."""
