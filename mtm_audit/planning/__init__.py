"""From measured accuracies to a scheme: which channels, alphabet and window lengths carry a payload soonest."""
