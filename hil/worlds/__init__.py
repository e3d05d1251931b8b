"""Plants with their task controllers."""
