"""`mtm-hil shim`: the C shim in the loop, beside the Python modulator."""

from pathlib import Path

from rich.console import Console

from hil.experiments.hardening.shim import JOB, compare, write_csv
from hil.experiments.runs.cells import CellStore
from hil.experiments.runs.proportion import Proportion
from hil.plants.mecanum import calibrated_parameters
from hil.vehicles.shim_library import load_shim


def shim(rollouts: int, out: Path | None, cells: Path, console: Console) -> None:
    """Run, print and, where asked, write the comparison."""
    load_shim()  # Fails at once where there is no compiler.
    plant = calibrated_parameters()
    with CellStore(cells) as store:
        found = compare(rollouts, plant, store, console)
    half, most = (f"{1000.0 * apart_m:.2g} mm" for apart_m in found.apart_m)
    apart = f"between the two runs a robot's place differs by at most {half} in half of the rollouts, {most} in all"
    print(f"messages of four symbols, T = {JOB.window_ticks}, read by the matched detector")
    print(f"played by Python:       {_share(found.python)}")
    print(f"played by the C shim:   {_share(found.shim)}")
    print(f"same symbols from both: {_share(found.same)}; {apart}")
    if out is not None:
        write_csv(out, found, f"mtm-hil shim -n {rollouts} --out {out}", (f"{plant}", apart))
        print(f"wrote {out}")


def _share(share: Proportion) -> str:
    low, high = share.interval_percent
    return f"{share.successes} of {share.trials}, {share.percent:.1f} % [{low:.1f}-{high:.1f}]"
