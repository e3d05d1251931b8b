"""The record of every tick, bounded in size."""
