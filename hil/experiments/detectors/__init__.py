"""How well detectors read the RoboMaster fleet: the paper's table, the bench, robustness, false alarms."""
