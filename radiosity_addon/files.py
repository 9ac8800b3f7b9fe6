"""Files that appear whole or not at all: staged beside their place, then renamed. No bpy."""

from __future__ import annotations

import glob
import os
import stat
from contextlib import contextmanager
from pathlib import Path

from .cleanup_process import CleanupProcess

WRITE_BITS = stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH


class Publication:
    """A set of files being written. ``commit`` puts all in place; leaving without it puts none.

    Use as a context manager::

        with Publication() as files:
            write_to(files.stage("result.blend"))
            files.commit()
    """

    def __init__(self) -> None:
        self._staged: list[tuple[Path, Path]] = []  # (temporary, final)
        self.committed: list[str] = []  # names of the files that are in their places
        self._cleanup = CleanupProcess()

    def __enter__(self) -> Publication:
        return self

    def __exit__(self, *_) -> None:
        self.discard()
        self._cleanup.dismiss()

    def stage(self, path: str | Path) -> Path:
        """A temporary path beside ``path``, with its ending, to write the contents to."""
        final = _followed(path)
        _remove_stale(final)
        temporary = final.with_name(f"{_prefix(final)}{os.getpid()}{final.suffix}")
        self._cleanup.watch(temporary.parent, _traces(temporary))
        self._staged.append((temporary, final))
        return temporary

    def commit(self) -> None:
        """Move every staged file to its place. Raises OSError, moving none, if one is missing."""
        for temporary, final in self._staged:
            if not temporary.is_file() or temporary.stat().st_size == 0:
                raise OSError(f"{final} was not written; is the disk full?")
        for temporary, final in self._staged:
            with naming(final, "the file"):
                _flush(temporary)
        while self._staged:
            temporary, final = self._staged[0]
            os.replace(temporary, final)
            self._staged.pop(0)
            self.committed.append(final.name)

    def discard(self) -> None:
        """Remove what was staged and not committed, and what Blender made on its way to it."""
        for temporary, _ in self._staged:
            for path in temporary.parent.glob(_traces(temporary)):
                path.unlink(missing_ok=True)
        self._staged.clear()


@contextmanager
def naming(path: str | Path, what: str):
    """An OSError inside, such as of a full disk, becomes one that says which file it is about, and what to do."""
    try:
        yield
    except OSError as error:
        raise OSError(f"{what} {path} cannot be written: {error.strerror or error}; free some space on its "
                      "disk, or choose another") from error  # fmt: skip


def check_writable(path: str | Path, what: str, remedy: str = "choose another") -> None:
    """Raise OSError, with a ``remedy``, unless a file can be created or replaced at ``path``."""
    path = _followed(path)
    check_folder(path.parent, what, remedy)
    if path.is_dir():
        raise OSError(f"{what} {path} is a folder; give a file name")
    if path.exists() and not path.is_file():
        raise OSError(f"{what} {path} is a device or a pipe, which a file cannot replace; give a file name")
    if path.exists() and not _may_write(path):
        raise OSError(f"{what} {path} is read-only; {remedy}, or make it writable")


def check_folder(folder: str | Path, what: str, remedy: str = "choose another") -> None:
    """Raise OSError, with a ``remedy``, unless files can be created in ``folder``."""
    folder = Path(folder)
    if not folder.exists():
        raise OSError(f"folder {folder} of {what} does not exist; create it or {remedy}")
    if not folder.is_dir():
        raise OSError(f"{folder}, the folder of {what}, is a file; {remedy}")
    if not _may_write(folder):
        raise OSError(f"folder {folder} of {what} is not writable; {remedy}")


def _followed(path: str | Path) -> Path:
    """Where a link leads, so that it stays; anything else is as it is."""
    path = Path(path)
    return path.resolve() if path.is_symlink() else path


def _may_write(path: Path) -> bool:
    """Access as the system grants it, and some write permission even for the superuser."""
    return os.access(path, os.W_OK) and bool(path.stat().st_mode & WRITE_BITS)


def _traces(temporary: Path) -> str:
    """Glob for ``temporary`` and what Blender makes beside it on its way there."""
    return f"*{glob.escape(temporary.stem)}*"


def _prefix(final: Path) -> str:
    return f".{final.name}.radiosity-"


def _remove_stale(final: Path) -> None:
    """Remove what a killed run left beside ``final``."""
    for leftover in final.parent.glob(f"*{glob.escape(_prefix(final))}*"):
        process = leftover.name.partition(_prefix(final))[2].split(".")[0]
        if process.isdigit() and not _is_running(int(process)):
            leftover.unlink(missing_ok=True)


def _is_running(process: int) -> bool:
    if os.name == "nt":
        return True  # signal 0 would end it there; a leftover stays until its name is reused
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def _flush(path: Path) -> None:
    """Ask the system to put the file on the disk, so that a power cut cannot leave it empty."""
    with open(path, "rb+") as handle:
        os.fsync(handle.fileno())
