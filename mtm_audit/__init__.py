"""What runs on the auditor's machine: from a recording to a verdict."""
