"""`mtm-audit duration`: how long to record."""

from pathlib import Path

from mtm_audit.planning.duration import required_duration
from mtm_audit.planning.table import read_table
from mtm_onboard.protocol.framing import payload_bits
from mtm_onboard.protocol.key import load_key


def run_duration(key_path: Path, table_path: Path, bits: int | None, target_accuracy: float) -> None:
    """Print how long a recording must be. `bits` None: all that a message of the key carries."""
    scheme = load_key(key_path).scheme
    held = payload_bits(scheme) if scheme.framing is None else scheme.framing.payload_bits
    wanted = held if bits is None else bits
    found = required_duration(scheme, read_table(table_path), wanted, target_accuracy)
    low, high = found.interval
    times = f"{found.repeats} {'message' if found.repeats == 1 else 'messages'} of {scheme.message_ticks} ticks"
    print(f"{found.anywhere_s:.2f} s of motion, wherever in a message it begins ({times} and one window)")
    print(f"{found.from_start_s:.2f} s when it begins with a message")
    print(
        f"predicted accuracy {found.accuracy:.3f} [{low:.3f}-{high:.3f}] of {wanted} bits; "
        f"{wanted / found.from_start_s:.3g} bits/s"
    )
    if found.beyond:
        print("windows or their repeats are longer than any measured; they count as the longest measured ones")
    if found.repeats_gain_less:
        print(
            f"the shortest window has {found.tones} tones, the same in every repeat of a fixed schedule, so repeats "
            "gain less than predicted: record a message more"
        )
