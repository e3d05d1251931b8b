"""`mtm-audit overhead`: the paper's table of what Reed-Solomon codes cost."""

from mtm_audit.planning.correction import ALPHABET_SIZES, overhead_table, two_digits


def run_overhead() -> None:
    """Print the table: factors on T per data goal, one of eight."""
    print("  ".join(("errors", f"{'best code':<9}", *(f"{f'M={M}':>5}" for M in ALPHABET_SIZES))))
    for code, factors in overhead_table():
        cells = (f"{f'{two_digits(factors[M])}x':>5}" for M in ALPHABET_SIZES)
        print("  ".join((f"{code.errors:>6}", f"{f'RS({code.length},{code.data})':<9}", *cells)))
