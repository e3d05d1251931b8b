"""What the commands read: fake keys, tables and a journal."""

import shutil
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).parent / "inputs"
_SECRET_BYTES = 32


@dataclass(frozen=True)
class FakeKey:
    """A key whose secret is one byte again and again, for the scheme in `<scheme>.toml`."""

    name: str
    scheme: str
    byte: int
    mode: int = 0o600

    def text(self) -> str:
        """The key file's text."""
        scheme = (FOLDER / f"{self.scheme}.toml").read_text(encoding="utf-8")
        return f'format = 1\nid = "{self.name}"\nsecret = "{bytes([self.byte] * _SECRET_BYTES).hex()}"\n\n{scheme}'


KEYS = (
    FakeKey("fleet", "fleet", 0x11),
    FakeKey("other", "fleet", 0x22),
    FakeKey("courier", "courier", 0x33),
    FakeKey("readable-by-all", "fleet", 0x11, 0o644),
)


def write_inputs(folder: Path) -> None:
    """Make `folder` with all inputs in it."""
    folder.mkdir()
    for path in FOLDER.glob("*.csv"):
        shutil.copyfile(path, folder / path.name)
    for key in KEYS:
        path = folder / f"{key.name}.key"
        path.write_text(key.text(), encoding="utf-8")
        path.chmod(key.mode)
