"""One format of logs or motion capture per file: how it is recognised, and its poses."""
