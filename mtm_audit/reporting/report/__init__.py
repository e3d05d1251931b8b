"""A decode as one HTML file that can be handed on: no script in it, and nothing that is fetched."""
