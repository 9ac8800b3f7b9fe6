"""Files appear whole or not at all."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest

from radiosity_addon.files import Publication, check_folder, check_writable

ROOT = Path(__file__).resolve().parents[1]


def test_nothing_is_in_place_before_commit_and_everything_after(tmp_path):
    with Publication() as files:
        for name in ("a.blend", "b.json"):
            files.stage(tmp_path / name).write_text(name)
        assert not (tmp_path / "a.blend").exists()
        files.commit()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.blend", "b.json"]
    assert (tmp_path / "b.json").read_text() == "b.json"


def test_failure_leaves_the_earlier_file_and_no_temporary(tmp_path):
    (tmp_path / "a.blend").write_text("earlier")
    with pytest.raises(RuntimeError), Publication() as files:
        temporary = files.stage(tmp_path / "a.blend")
        temporary.write_text("half")
        for name in (f"{temporary.name}@", f".{temporary.stem}.partial{temporary.suffix}"):
            temporary.with_name(name).write_text("a half that Blender makes on its way")
        raise RuntimeError
    assert [path.name for path in tmp_path.iterdir()] == ["a.blend"]
    assert (tmp_path / "a.blend").read_text() == "earlier"


@pytest.mark.parametrize("contents", [None, ""])
def test_one_file_missing_or_empty_commits_none(tmp_path, contents):
    with Publication() as files:
        files.stage(tmp_path / "a.blend").write_text("whole")
        second = files.stage(tmp_path / "b.blend")
        if contents is not None:
            second.write_text(contents)
        with pytest.raises(OSError, match="b.blend was not written"):
            files.commit()
    assert list(tmp_path.iterdir()) == []


def test_the_temporary_keeps_the_ending(tmp_path):
    """Blender chooses formats and adds endings by the name."""
    with Publication() as files:
        assert files.stage(tmp_path / "a.blend").suffix == ".blend"


def test_what_a_killed_run_left_is_removed_by_the_next(tmp_path):
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait()  # its number belongs to nobody now
    dead = tmp_path / f".a.blend.radiosity-{child.pid}.blend"
    alive = tmp_path / f".a.blend.radiosity-{os.getppid()}.blend"
    for leftover in (dead, alive):
        leftover.write_text("half")
    with Publication() as files:
        files.stage(tmp_path / "a.blend")
    assert not dead.exists()
    assert alive.exists()


def test_killed_process_leaves_the_earlier_file_and_no_temporary(tmp_path):
    folder = tmp_path / "odd [name] é"
    folder.mkdir()
    (folder / "a.blend").write_text("earlier")
    script = """
        import sys, time
        from radiosity_addon.files import Publication
        with Publication() as files:
            for name in ("a.blend", "b.json"):
                temporary = files.stage(sys.argv[1] + "/" + name)
                temporary.write_text("half")
                temporary.with_name(temporary.name + "@").write_text("half")
            print("ready", flush=True)
            time.sleep(20)
    """
    child = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(script), str(folder)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert child.stdout.readline() == "ready\n"
    assert len(list(folder.iterdir())) == 5
    child.kill()
    child.communicate()
    deadline = time.monotonic() + 5
    while len(list(folder.iterdir())) > 1 and time.monotonic() < deadline:
        time.sleep(0.02)
    assert [path.name for path in folder.iterdir()] == ["a.blend"]
    assert (folder / "a.blend").read_text() == "earlier"


def test_missing_folder_is_named(tmp_path):
    with pytest.raises(OSError, match="nowhere.*does not exist; create it"):
        check_writable(tmp_path / "nowhere" / "a.blend", "--output")


def test_folder_that_is_a_file(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="is a file"):
        check_folder(tmp_path / "file", "--image-dir")


def test_name_of_a_folder(tmp_path):
    with pytest.raises(OSError, match="is a folder"):
        check_writable(tmp_path, "--report")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names on this system")
def test_a_device_or_pipe_is_no_place_for_a_file(tmp_path):
    """A rename would put a file where the null device or the terminal was, for everyone on the machine."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to(tmp_path / "pipe")
    for name in ("pipe", "link"):
        with pytest.raises(OSError, match="--report .*pipe is a device or a pipe.*give a file name"):
            check_writable(tmp_path / name, "--report")
    with pytest.raises(OSError, match="device or a pipe"):
        check_writable(os.devnull, "--report")


def test_links_stay_and_what_they_lead_to_is_written(tmp_path):
    (tmp_path / "folder").mkdir()
    real, link = tmp_path / "folder" / "real.json", tmp_path / "link.json"
    real.write_text("earlier")
    try:
        link.symlink_to(real)
    except OSError:
        pytest.skip("links need more rights here")
    check_writable(link, "--report")
    with Publication() as files:
        files.stage(link).write_text("later")
        files.commit()
    assert link.is_symlink() and real.read_text() == "later"


def test_read_only_folder_and_file_are_refused_even_for_the_superuser(tmp_path):
    folder, file = tmp_path / "locked", tmp_path / "a.blend"
    folder.mkdir()
    file.write_text("earlier")
    folder.chmod(0o555)
    file.chmod(0o444)
    try:
        with pytest.raises(OSError, match="not writable"):
            check_writable(folder / "a.blend", "--output")
        with pytest.raises(OSError, match="read-only"):
            check_writable(file, "--output")
    finally:
        folder.chmod(0o755)


def test_no_janitor_is_no_failure(tmp_path, monkeypatch, caplog):
    monkeypatch.setattr(sys, "executable", str(tmp_path / "no python"))
    with Publication() as files:
        files.stage(tmp_path / "a.blend").write_text("whole")
        files.commit()
    assert (tmp_path / "a.blend").read_text() == "whole"
    assert "no cleanup process" in caplog.text
