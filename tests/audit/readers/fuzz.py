"""Damaged recordings into every reader: each must be read or refused in one sentence, and soon.

    python -m tests.audit.readers.fuzz -n 1000000 --out fuzz_readers.csv

Each input is a valid file of one format with one to four kinds of damage, drawn from the seed and its number alone, so
that `--only FORMAT --first NUMBER -n 1` repeats one. A reader runs in a process of its own: a crash of a native library
or a hang is told like any other failure, and the next input goes on behind it. Finished batches are kept in a file, so
that an interrupted search goes on where it stopped.
"""

import argparse
import ctypes
import multiprocessing
import os
import random
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from hil.experiments.runs.cells import Cell, CellStore, Scalar
from hil.experiments.runs.result_file import write_result_csv
from mtm_audit.readers.logs.registry import read_log
from mtm_audit.readers.video import inspect_video, read_frames
from mtm_audit.readers.video.compression import read_compression
from mtm_onboard.protocol import MtmError
from tests.audit.readers.every_format import ALL, OURS
from tests.audit.readers.moving_pose import driving
from tests.audit.readers.video.films import KINDS, pictures, write_film

FILMS = {f"film {name}": partial(write_film, images=pictures(12), encoding=KINDS[name]) for name in KINDS}
EVERY = (*ALL, *FILMS)
BATCH = 25_000
# In memory where the system offers a place there: a disk costs more than the reader.
MEMORY = Path("/dev/shm")
# Longer than the one reader that stops its library.
LONGEST_S = 40.0
OUTCOMES = ("read", "refused", "traceback", "crashed", "hung")
_WORDS = (
    b"nan", b"inf", b"-1e308", b"1e400", b"", b"0", b"-", b",", b";", b"\t", b'"', b"\n", b"\r\n", b"\x00", b"#",
    b"\xff", b"9" * 400, b"1_0", b"Frame", b"timestamp", b"[mm]", b"\xef\xbb\xbf", b"\xff\xfe",
)  # fmt: skip


class _Told(ctypes.Structure):
    """What the process that reads tells the one that waits, in memory of both."""

    _fields_ = (
        ("next", ctypes.c_longlong), ("counts", ctypes.c_longlong * len(OUTCOMES)), ("slowest_s", ctypes.c_double),
        ("processor_s", ctypes.c_double),
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


def outcome(path: Path, *, film: bool = False) -> tuple[str, str]:
    """What became of one file, and the traceback if there was one."""
    try:
        _read_film(path) if film else read_log(path)
    except MtmError as error:
        return ("refused", "") if "\n" not in str(error) else ("traceback", f"more than one line: {error}")
    except Exception:
        return "traceback", traceback.format_exc()
    return "read", ""


def _read_film(path: Path) -> None:
    inspect_video(path)
    read_compression(path)
    for _ in read_frames(path, "bgr"):
        pass


def original(name: str, folder: Path) -> tuple[Path, bytes]:
    """The one file of a format that is damaged, and its bytes."""
    if name in FILMS:
        path = FILMS[name](folder / name.removeprefix("film "))
    else:
        path = ALL[name](folder, driving(seconds=0.4))
    if path.is_dir():
        path = next(file for file in path.iterdir() if file.suffix in (".db3", ".mcap"))
    return path, path.read_bytes()


def _processor_s() -> float:
    """Of this process and of those that it waited for."""
    return sum(os.times()[:4])


@contextmanager
def _quick_folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(dir=MEMORY if os.access(MEMORY, os.W_OK) else None) as folder:
        yield Path(folder)


def _work(name: str, seed: int, first: int, end: int, told: Any, pipe: Connection) -> None:
    """Read the damaged files `first` to `end`; `told` holds which comes next, counts by outcome, and what it took.

    Texts of failures go through the pipe, None when all is done.
    """
    with _quick_folder() as folder:
        path, data = original(name, folder)
        for number in range(first, end):
            path.write_bytes(damaged(random.Random(f"{name} {seed} {number}"), data))
            began_s = _processor_s()
            result, text = outcome(path, film=name in FILMS)
            told.slowest_s = max(told.slowest_s, _processor_s() - began_s)
            told.counts[OUTCOMES.index(result)] += 1
            if text:
                pipe.send(text)
            told.next = number + 1
        told.processor_s = _processor_s()
    pipe.send(None)


class Fuzzing:
    """Inputs of one format: counts by outcome, the failures, the slowest input, and what all of them took."""

    def __init__(self, name: str, seed: int) -> None:
        self.name, self.counts, self.slowest_s, self.processor_s = name, Counter[str](), 0.0, 0.0
        self.failures: list[str] = []
        self._seed = seed

    def run(self, first: int, count: int) -> None:
        """Read the inputs `first` to `first + count`, whatever becomes of the processes that do."""
        context = multiprocessing.get_context("fork")
        number, end = first, first + count
        while number < end:
            told = context.Value(_Told, lock=False)
            told.next = number
            here, there = context.Pipe(duplex=False)
            worker = context.Process(target=_work, args=(self.name, self._seed, number, end, told, there), daemon=True)
            worker.start()
            there.close()
            try:
                failure = self._waited(here, told)
            finally:
                worker.kill()
                worker.join()
            self.counts.update(dict(zip(OUTCOMES, told.counts, strict=True)))
            self.slowest_s = max(self.slowest_s, told.slowest_s)
            self.processor_s += told.processor_s
            number = told.next
            if failure:
                self.counts[failure] += 1
                self.failures.append(f"{self.name} {number}: {failure}")
                number += 1

    def _waited(self, pipe: Connection, told: Any) -> str | None:
        """How the process failed before it had read all; None when it did not."""
        number, since_s = told.next, time.monotonic()
        while True:
            try:
                if pipe.poll(1.0):
                    text = pipe.recv()
                    if text is None:
                        return None
                    self.failures.append(f"{self.name} {told.next}: {text}")
            except EOFError:
                return "crashed"
            if told.next != number:
                number, since_s = told.next, time.monotonic()
            elif time.monotonic() - since_s > LONGEST_S:
                return "hung"


def batch(parameters: Mapping[str, Scalar], seed: int) -> dict[str, Scalar]:
    """What became of the inputs of one batch."""
    one = Fuzzing(str(parameters["format"]), seed)
    one.run(int(parameters["first"]), int(parameters["inputs"]))
    counts = {name: one.counts[name] for name in OUTCOMES}
    took = {"slowest_s": round(one.slowest_s, 2), "processor_s": round(one.processor_s, 1)}
    return {**counts, **took, "failures": "\n".join(one.failures[:20])}


def batches(name: str, seed: int, first: int, inputs: int) -> list[Cell]:
    """The inputs of one format as units of work, each of which is kept when it is finished."""
    starts = range(first, first + inputs, BATCH)
    return [
        Cell("fuzz readers", {"format": name, "first": start, "inputs": min(BATCH, first + inputs - start)}, seed)
        for start in starts
    ]


def _asked() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Damaged recordings into every reader.")
    parser.add_argument("-n", "--inputs", type=int, default=10_000, help="of all chosen formats read without a library")
    parser.add_argument(
        "--library-inputs", type=int, default=500, help="of each chosen format that is read by a library"
    )
    parser.add_argument("--first", type=int, default=0, help="number of the first input of each format")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", choices=sorted(EVERY), action="append", help="one format; may be repeated")
    parser.add_argument("--out", type=Path, help="a table of the counts")
    parser.add_argument("--cells", type=Path, default=Path("out/cells/fuzz_readers.jsonl"), help="finished batches")
    return parser.parse_args()


def _line(name: str, seed: int, results: list[Mapping[str, Scalar]]) -> tuple[object, ...]:
    counts = [sum(int(result[outcome]) for result in results) for outcome in OUTCOMES]
    slowest_s = max((float(result["slowest_s"]) for result in results), default=0.0)
    processor_s = sum(float(result["processor_s"]) for result in results)
    return name, seed, sum(counts), *counts, f"{slowest_s:.2f}", f"{processor_s:.1f}"


def main() -> int:
    """Fuzz as the command line says; 1 when anything but reading and refusing happened."""
    asked = _asked()
    names = asked.only or list(EVERY)
    ours = [name for name in names if name in OURS]
    lines, failures = [], []
    with CellStore(asked.cells) as store:
        for name in names:
            inputs = -(-asked.inputs // len(ours)) if name in OURS else asked.library_inputs
            results = []
            for cell in batches(name, asked.seed, asked.first, inputs):
                if store.find(cell) is None:
                    store.add(cell, batch(cell.parameters, cell.seed))
                results.append(store.find(cell) or {})
            failures += [str(result["failures"]) for result in results if result["failures"]]
            lines.append(_line(name, asked.seed, results))
            print(*lines[-1], sep=", ", flush=True)
    print("\n".join(failures))
    if asked.out is not None:
        command = f"python -m tests.audit.readers.fuzz {' '.join(sys.argv[1:])}"
        write_result_csv(asked.out, command, ("format", "seed", "inputs", *OUTCOMES, "slowest_s", "processor_s"), lines)
    print(f"{sum(int(str(line[2])) for line in lines)} inputs, {len(failures)} batches with failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
