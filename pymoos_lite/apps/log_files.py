"""The one place where the logger touches the disk: a folder of growing files."""

from __future__ import annotations

import gzip
import io
from collections.abc import Callable
from pathlib import Path
from typing import IO

BUFFER = 1 << 20
MAX_COPY = 32 << 20


class LogFolder:
    """Creates a folder and appends to files in it. Writes are buffered until `flush`.

    With `fresh`, a folder that exists is left alone and a number is put behind the name: equal runs in
    lockstep have equal names, and the second one must not overwrite the first.
    """

    def __init__(self, base: Path, name: str, *, fresh: bool) -> None:
        path = base / name
        number = 1
        while fresh and path.exists():
            number += 1
            path = base / f"{name}_{number}"
        path.mkdir(parents=True, exist_ok=True)
        self.path = path
        self._raw: list[IO[bytes]] = []
        self._files: list[IO[bytes] | IO[str]] = []

    def open_text(self, name: str, *, compress: bool = False) -> Callable[[str], object]:
        """Create (or empty) a text file and return what appends to it."""
        raw = self._create(f"{name}.gz" if compress else name, compress)
        text = io.TextIOWrapper(raw, encoding="utf-8", errors="backslashreplace", newline="\n")
        self._files.append(text)
        return text.write

    def open_binary(self, name: str) -> Callable[[bytes], object]:
        """Create (or empty) a binary file and return what appends to it."""
        raw = self._create(name, compress=False)
        self._files.append(raw)
        return raw.write

    def _create(self, name: str, compress: bool) -> IO[bytes]:
        raw = (self.path / name).open("wb", buffering=BUFFER)
        self._raw.append(raw)
        if not compress:
            return raw
        # No time stamp and no name inside: equal logs compress to equal files.
        return gzip.GzipFile(filename="", mode="wb", fileobj=raw, mtime=0)  # type: ignore[return-value]

    def write_file(self, name: str, content: bytes) -> None:
        (self.path / name).write_bytes(content)

    def flush(self) -> None:
        for file in self._files:
            file.flush()

    def close(self) -> None:
        # The compressors first, then the files below them.
        files: list[IO[bytes] | IO[str]] = [*self._files, *self._raw]
        self._files, self._raw = [], []
        for file in files:
            file.close()


def read_small_file(path: Path) -> bytes | None:
    """Content of a file that is to be copied into the log; None if it is missing, special or too large."""
    try:
        if not path.is_file() or path.stat().st_size > MAX_COPY:
            return None
        return path.read_bytes()
    except (OSError, ValueError):
        return None
