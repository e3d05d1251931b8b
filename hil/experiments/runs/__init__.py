"""What all experiments share: cells and their store, sweeps over cells, intervals and result files."""
