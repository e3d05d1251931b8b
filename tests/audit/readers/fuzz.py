"""Damaged recordings into every reader: each must be read or refused in one sentence, and soon.

    python -m tests.audit.readers.fuzz -n 100000 --out fuzz_readers.csv

Each input is a valid file of one format with one to four kinds of damage, drawn from the seed and its number alone, so
that `--only FORMAT --first NUMBER -n 1` repeats one. A reader runs in a process of its own: a crash of a native library
or a hang is told like any other failure, and the next input goes on behind it. Ctrl-C stops and prints what was found.
"""

import argparse
import csv
import multiprocessing
import random
import sys
import tempfile
import time
import traceback
from collections import Counter
from multiprocessing.connection import Connection
from pathlib import Path

from tests.audit.readers.every_format import ALL
from tests.audit.readers.moving_pose import driving

# Longer than the one reader that stops its library.
LONGEST_S = 40.0
OUTCOMES = ("read", "refused", "traceback", "crashed", "hung")
_WORDS = (
    b"nan", b"inf", b"-1e308", b"1e400", b"", b"0", b"-", b",", b";", b"\t", b'"', b"\n", b"\r\n", b"\x00", b"#",
    b"\xff", b"9" * 400, b"1_0", b"Frame", b"timestamp", b"[mm]", b"\xef\xbb\xbf", b"\xff\xfe",
)  # fmt: skip


def damaged(draw: random.Random, data: bytes) -> bytes:
    """The bytes with one to four kinds of damage."""
    damage = bytearray(data)
    for _ in range(draw.randint(1, 4)):
        draw.choice((_flip, _cut, _repeat, _swap, _insert, _set_number, _drop))(draw, damage)
    return bytes(damage)


def _place(draw: random.Random, data: bytearray) -> int:
    # Half of the damage falls on the header.
    return draw.randrange(min(len(data), 600) if draw.random() < 0.5 else len(data)) if data else 0


def _flip(draw: random.Random, data: bytearray) -> None:
    for _ in range(draw.randint(1, 8)):
        if data:
            data[_place(draw, data)] ^= 1 << draw.randrange(8)


def _cut(draw: random.Random, data: bytearray) -> None:
    del data[_place(draw, data) :]


def _drop(draw: random.Random, data: bytearray) -> None:
    at = _place(draw, data)
    del data[at : at + draw.randint(1, 200)]


def _repeat(draw: random.Random, data: bytearray) -> None:
    at = _place(draw, data)
    data[at:at] = data[at : at + draw.randint(1, 200)]


def _swap(draw: random.Random, data: bytearray) -> None:
    first, second = sorted((_place(draw, data), _place(draw, data)))
    length = draw.randint(1, 40)
    if second + length <= len(data) and first + length <= second:
        data[first : first + length], data[second : second + length] = (
            data[second : second + length], data[first : first + length],
        )  # fmt: skip


def _insert(draw: random.Random, data: bytearray) -> None:
    at = _place(draw, data)
    data[at:at] = draw.choice(_WORDS)


def _set_number(draw: random.Random, data: bytearray) -> None:
    at = _place(draw, data)
    value = draw.choice((0, 1, 0x7F, 0x80, 0xFF)).to_bytes(1, "little") * draw.choice((1, 2, 4, 8))
    data[at : at + len(value)] = value[: len(data) - at]


def outcome(path: Path) -> tuple[str, str]:
    """What became of one file, and the traceback if there was one."""
    from mtm_audit.readers.logs.registry import read_log
    from mtm_onboard.protocol import MtmError

    try:
        read_log(path)
    except MtmError as error:
        return ("refused", "") if "\n" not in str(error) else ("traceback", f"more than one line: {error}")
    except Exception:
        return "traceback", traceback.format_exc()
    return "read", ""


def original(name: str, folder: Path) -> tuple[Path, bytes]:
    """The one file of a format that is damaged, and its bytes."""
    path = ALL[name](folder, driving(seconds=0.4))
    if path.is_dir():
        path = next(file for file in path.iterdir() if file.suffix in (".db3", ".mcap"))
    return path, path.read_bytes()


def _work(name: str, seed: int, first: int, count: int, pipe: Connection) -> None:
    """Read `count` damaged files from number `first` on, and send what became of each."""
    with tempfile.TemporaryDirectory() as folder:
        path, data = original(name, Path(folder))
        for number in range(first, first + count):
            path.write_bytes(damaged(random.Random(f"{name} {seed} {number}"), data))
            began_s = time.monotonic()
            result = outcome(path)
            pipe.send((number, *result, time.monotonic() - began_s))
    pipe.send(None)


class Fuzzing:
    """The inputs of one format: counts by outcome, the first failures, and the slowest input."""

    def __init__(self, name: str, seed: int) -> None:
        self.name, self.counts, self.slowest_s = name, Counter[str](), 0.0
        self.failures: list[str] = []
        self._seed = seed

    def run(self, first: int, count: int) -> None:
        """Read the inputs `first` to `first + count`, whatever becomes of the processes that do."""
        context = multiprocessing.get_context("fork")
        number, end = first, first + count
        while number < end:
            here, there = context.Pipe(duplex=False)
            worker = context.Process(
                target=_work, args=(self.name, self._seed, number, end - number, there), daemon=True
            )
            worker.start()
            there.close()
            try:
                number = self._collect(here, number, end)
            finally:
                worker.kill()
                worker.join()

    def _collect(self, pipe: Connection, number: int, end: int) -> int:
        """The number of the input to go on with."""
        while number < end:
            if not pipe.poll(LONGEST_S):
                return self._failed("hung", number, f"longer than {LONGEST_S:g} s")
            try:
                told = pipe.recv()
            except EOFError:
                return self._failed("crashed", number, "the process died")
            if told is None:
                break
            _, result, text, took_s = told
            self.counts[result] += 1
            self.slowest_s = max(self.slowest_s, took_s)
            if text:
                self.failures.append(f"{self.name} {number}: {text}")
            number += 1
        return number

    def _failed(self, how: str, number: int, text: str) -> int:
        self.counts[how] += 1
        self.failures.append(f"{self.name} {number}: {how}, {text}")
        return number + 1


def main() -> int:
    """Fuzz as the command line says; 1 when anything but reading and refusing happened."""
    parser = argparse.ArgumentParser(description="Damaged recordings into every reader.")
    parser.add_argument("-n", "--inputs", type=int, default=10_000, help="inputs of all formats together")
    parser.add_argument("--first", type=int, default=0, help="number of the first input of each format")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", choices=sorted(ALL), action="append", help="one format; may be repeated")
    parser.add_argument("--out", type=Path, help="a table of the counts")
    asked = parser.parse_args()
    names = asked.only or list(ALL)
    done: list[Fuzzing] = []
    try:
        for name in names:
            done.append(Fuzzing(name, asked.seed))
            done[-1].run(asked.first, -(-asked.inputs // len(names)))
            print(name, dict(done[-1].counts), f"slowest {done[-1].slowest_s:.2f} s", flush=True)
    except KeyboardInterrupt:
        print("stopped")
    failures = [failure for item in done for failure in item.failures]
    print("\n".join(failures[:20]))
    if asked.out is not None:
        with asked.out.open("w", newline="") as file:
            table = csv.writer(file)
            table.writerow(["format", "seed", "inputs", *OUTCOMES, "slowest_s"])
            for item in done:
                counts = [item.counts[name] for name in OUTCOMES]
                table.writerow([item.name, asked.seed, item.counts.total(), *counts, f"{item.slowest_s:.2f}"])
    print(f"{sum(item.counts.total() for item in done)} inputs, {len(failures)} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
