"""Our detector: whitened, with one plant for the whole recording, decided and estimated together."""
