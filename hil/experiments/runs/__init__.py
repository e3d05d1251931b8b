"""What every experiment stands on: cells that are kept, sweeps over them, intervals and result files."""
