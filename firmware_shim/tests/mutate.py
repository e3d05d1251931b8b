"""Change guard.c in one place at a time and see whether its test notices: `python mutate.py`.

Every mutant must be killed by tests/test_guard.c or stand in mutants_explained.txt with the reason why it cannot be.
"""

import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src" / "guard.c"
EXPLAINED = ROOT / "tests" / "mutants_explained.txt"
_FLAGS = [
    "gcc",
    "-std=c99",
    "-O0",
    "-Werror=return-type",
    "-fsanitize=bounds-strict",
    "-fno-sanitize-recover=all",
    "-I",
    "include",
    "-I",
    "src",
]

# What is found in a line, and what takes its place. Longer operators come first, each found only as a whole.
_SWAPS = [
    (r"(?<![<>-])<(?![<=])", ["<=", ">="]),
    (r"(?<![<>-])>(?![>=])", [">=", "<="]),
    (r"<=", ["<", ">"]),
    (r">=", [">", "<"]),
    (r"==", ["!="]),
    (r"!=", ["=="]),
    (r"&&", ["||"]),
    (r"\|\|", ["&&"]),
    (r" \+ ", [" - "]),
    (r" - ", [" + "]),
    (r" \* ", [" / "]),
    (r" / ", [" * "]),
    (r"\+\+", ["--"]),
    (r"!(?!=)", [""]),
    (r"(?<= )-(?=\w)", [""]),
    (r"\b\d+\b", ["{+1}", "{-1}"]),
    (r"\bUINT32_MAX\b", ["(UINT32_MAX - 1)"]),
    (r"\bMTM_Q20_MAX\b", ["(MTM_Q20_MAX - 1)", "(MTM_Q20_MAX + 1)"]),
    (r"\bMTM_Q20_INVALID\b", ["(MTM_Q20_INVALID + 1)"]),
    (r"\bMTM_GAIN_ONE\b", ["(MTM_GAIN_ONE - 1)"]),
    (r"\bMTM_AXES\b", ["(MTM_AXES - 1)"]),
    (r"(?<=\? )(\w[^:;]*) : ([^;]+)(?=;)", [r"\2 : \1"]),
    (r"^(\s+)(?!const|uint32_t|return)\S.*;$", [r"\1;"]),
]


def mutants(lines: list[str]) -> Iterator[tuple[int, str]]:
    """Each line number with one changed text, over the code of the file."""
    for number, line in enumerate(lines):
        if line.startswith(("#", "/*", " *")) or line.lstrip().startswith("/*"):
            continue
        for pattern, replacements in _SWAPS:
            for match in re.finditer(pattern, line):
                for replacement in replacements:
                    new = _filled(match, replacement)
                    changed = line[: match.start()] + new + line[match.end() :]
                    if changed != line:
                        yield number, changed


def _filled(match: re.Match[str], replacement: str) -> str:
    if replacement in ("{+1}", "{-1}"):
        return f"({match.group()} {replacement[1]} 1)"
    return match.expand(replacement) if "\\" in replacement else replacement


def survives(text: str, folder: Path) -> bool:
    """True when the changed file compiles and its test passes all the same."""
    changed, program = folder / "guard.c", folder / "test_guard"
    changed.write_text(text, encoding="utf-8")
    build = [*_FLAGS, str(changed), "src/image.c", "tests/test_guard.c", "-o", str(program)]
    if subprocess.run(build, cwd=ROOT, capture_output=True, check=False).returncode:
        return False
    try:
        return subprocess.run([str(program)], capture_output=True, timeout=10, check=False).returncode == 0
    except subprocess.TimeoutExpired:
        return False


def explained() -> dict[tuple[str, str], str]:
    """Original and changed line, without indentation, to the reason why no test can tell them apart."""
    found = {}
    for block in EXPLAINED.read_text(encoding="utf-8").strip().split("\n\n"):
        before, after, reason = (line.split(": ", 1)[1] for line in block.split("\n"))
        found[before, after] = reason
    return found


def main() -> int:
    """Print what became of the mutants; 1 when one survived without a reason."""
    lines = SOURCE.read_text(encoding="utf-8").split("\n")
    reasons, killed, excused, survivors = explained(), 0, 0, 0
    with tempfile.TemporaryDirectory() as name:
        if not survives("\n".join(lines), Path(name)):
            print("the test fails on guard.c as it is; mend that first")
            return 1
        for number, changed in mutants(lines):
            text = "\n".join([*lines[:number], changed, *lines[number + 1 :]])
            if not survives(text, Path(name)):
                killed += 1
            elif (lines[number].strip(), changed.strip()) in reasons:
                excused += 1
            else:
                survivors += 1
                print(f"survived, line {number + 1}:\n  was: {lines[number].strip()}\n  now: {changed.strip()}")
    print(f"mutants of guard.c: {killed} killed, {excused} explained, {survivors} survived")
    return 1 if survivors else 0


if __name__ == "__main__":
    sys.exit(main())
