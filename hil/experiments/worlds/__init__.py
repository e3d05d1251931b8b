"""The paper's four simulated worlds: its tables, null conditions and what the noise costs the tasks."""
