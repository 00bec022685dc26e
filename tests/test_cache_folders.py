"""Machine code lies where the user wants it and nobody else can put any; what is no longer used goes away."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from numba.core import config

from mjwrap.kernels.compilation import cache_folders, folder_owners

needs_owners = pytest.mark.skipif(os.name == "nt", reason="files have no numbered owners there")
needs_root = pytest.mark.skipif(
    os.name == "nt" or os.getuid() != 0, reason="only root gives files away, to look as somebody else's"
)
DAY = 86_400.0
SOMEBODY = 54_321  # a user that is neither this one nor root


@pytest.fixture
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A machine on which every place for a cache is under one folder."""
    monkeypatch.setattr(config, "CACHE_DIR", "")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    cache_folders.private.cache_clear()
    yield tmp_path
    cache_folders.private.cache_clear()


# --------------------------------------------------------------------------------- where it is kept


def test_the_cache_is_where_the_user_wants_it(places: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert cache_folders.find_base() == places / "xdg" / "mjwrap"
    monkeypatch.setattr(config, "CACHE_DIR", str(places / "numba"))
    assert cache_folders.find_base() == places / "numba" / "mjwrap"


def test_a_place_that_cannot_be_written_is_passed_over(places: Path) -> None:
    (places / "xdg").write_text("a file where a folder is wanted")
    found = cache_folders.find_base()
    assert found.is_relative_to(places / "temporary")
    assert cache_folders.find_base() == found


def test_a_user_without_a_home(places: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setattr(os.path, "expanduser", lambda path: path)
    assert cache_folders.find_base().is_relative_to(places / "temporary")


@needs_root
def test_machine_code_of_somebody_else_is_not_trusted(places: Path) -> None:
    """Anyone may make the folder in the temporary one; loading machine code runs it."""
    (places / "xdg").touch()
    shared = cache_folders.find_base()
    os.chown(shared, SOMEBODY, -1)
    found = cache_folders.find_base()
    assert found != shared
    assert found.is_relative_to(places / "temporary")


@needs_owners
def test_machine_code_of_another_user_is_not_trusted(places: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As above, where this is no root."""
    (places / "xdg").touch()
    shared = cache_folders.find_base()
    monkeypatch.setattr(folder_owners, "trusted", lambda: {SOMEBODY, os.lstat(shared.parent).st_uid + 1})
    found = cache_folders.find_base()
    assert found != shared
    assert found.is_relative_to(places / "temporary")


def test_without_any_lasting_place_each_process_has_its_own(
    places: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocked = places / "blocked"
    blocked.touch()
    monkeypatch.setattr(cache_folders, "_candidates", lambda: [blocked, blocked / "below"])
    first = cache_folders.find_base()
    assert cache_folders.find_base() == first
    cache_folders.private.cache_clear()  # as in another process
    second = cache_folders.find_base()
    assert first != second
    assert first.is_dir()
    assert second.is_relative_to(places / "temporary")


# ------------------------------------------------------------------------------ whom it is taken from


@needs_owners
@pytest.mark.parametrize("mode", [0o777, 0o775, 0o757, 0o1777])
def test_a_folder_that_others_may_write_to_is_refused(
    mode: int, places: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Loading machine code runs it; here the folder of the machine code itself is open to others."""
    monkeypatch.setattr(folder_owners, "_is_private", lambda group: False)
    open_to_all = places / "numba" / "mjwrap"
    open_to_all.mkdir(parents=True)
    open_to_all.chmod(mode)
    monkeypatch.setattr(config, "CACHE_DIR", str(places / "numba"))
    assert cache_folders.find_base() == places / "xdg" / "mjwrap"
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"mjwrap: no machine code is kept in {open_to_all}: ")
    assert "may write to" in line
    assert line.endswith(f"it is kept in {places / 'xdg' / 'mjwrap'} instead")
    assert list(open_to_all.iterdir()) == []


@needs_owners
@pytest.mark.parametrize("depth", [1, 2, 3])
def test_a_folder_above_counts_too(depth: int, places: Path) -> None:
    """Who may write to a folder may put another one in the place of those in it."""
    folder = places / "a" / "b" / "c" / "d"
    folder.mkdir(parents=True)
    assert folder_owners.objection(folder) is None
    above = folder.parents[depth - 1]
    above.chmod(0o777)
    assert folder_owners.objection(folder) == f"anyone may write to {above}"
    above.chmod(0o1777)  # like /tmp: what is in there can only be replaced by its owner
    assert folder_owners.objection(folder) is None
    assert folder_owners.objection(folder / "still" / "to" / "be" / "made") is None


@needs_owners
def test_links_are_followed_one_by_one(places: Path) -> None:
    real, shared, here = places / "real", places / "shared", places / "here"
    for folder in (real, shared, here):
        folder.mkdir()
    (shared / "link").symlink_to(real)
    (here / "first").symlink_to(shared / "link")
    assert folder_owners.objection(here / "first") is None
    shared.chmod(0o777)  # the second link may be turned elsewhere, though neither end is open to anyone
    assert folder_owners.objection(here / "first") == f"anyone may write to {shared}"
    assert folder_owners.objection(real) is None
    shared.chmod(0o755)
    real.chmod(0o777)
    assert folder_owners.objection(here / "first" / "mjwrap") == f"anyone may write to {real}"
    real.chmod(0o1777)
    assert folder_owners.objection(here / "first") == f"anyone may write to {real}"
    (here / "round").symlink_to(here / "round")
    assert not cache_folders._is_fit(here / "round" / "mjwrap", [])


@needs_root
@pytest.mark.parametrize("depth", [0, 1, 2])
def test_a_folder_of_somebody_else_is_refused(depth: int, places: Path) -> None:
    folder = places / "a" / "b" / "c"
    folder.mkdir(parents=True)
    theirs = [folder, *folder.parents][depth]
    os.chown(theirs, SOMEBODY, -1)
    assert folder_owners.objection(folder) == f"{theirs} belongs to user {SOMEBODY}"


@needs_root
def test_a_link_of_somebody_else_is_refused(places: Path) -> None:
    (places / "real").mkdir()
    link = places / "temporary" / "link"
    link.symlink_to(places / "real")
    os.chown(link, SOMEBODY, -1, follow_symlinks=False)
    (places / "temporary").chmod(0o1777)
    assert folder_owners.objection(link) == f"{link} belongs to user {SOMEBODY}"


@needs_owners
def test_a_private_group_may_write(places: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where every user has a group of one, folders are often made open to it."""
    folder = places / "folder"
    folder.mkdir()
    folder.chmod(0o775)
    monkeypatch.setattr(folder_owners, "_is_private", lambda group: group == folder.stat().st_gid)
    assert folder_owners.objection(folder) is None
    monkeypatch.setattr(folder_owners, "_is_private", lambda group: False)
    assert folder_owners.objection(folder) == f"group {folder.stat().st_gid} may write to {folder}"


@needs_owners
@pytest.mark.parametrize(
    ("name", "members", "private"),
    [("me", [], True), ("me", ["me"], True), ("me", ["me", "you"], False), ("staff", [], False)],
)
def test_which_group_is_private(
    name: str, members: list[str], private: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    import grp
    import pwd

    user = pwd.struct_passwd(("me", "x", os.getuid(), 77, "", "/home/me", "/bin/sh"))
    monkeypatch.setattr(pwd, "getpwuid", lambda number: user)
    monkeypatch.setattr(grp, "getgrgid", lambda number: grp.struct_group((name, "x", number, members)))
    assert folder_owners._is_private(77) is private
    assert not folder_owners._is_private(78)


@needs_owners
@pytest.mark.parametrize("mask", [0o000, 0o002, 0o022])
def test_new_folders_are_for_their_user_alone(mask: int, places: Path) -> None:
    before = os.umask(mask)
    try:
        folder = cache_folders.find_base()
        cache_folders.make_version(folder / "mjwrap.kernels.some-0123456789abcdef")
    finally:
        os.umask(before)
    for way in (folder, folder.parent, folder / "mjwrap.kernels.some-0123456789abcdef"):
        assert way.stat().st_mode & 0o777 == 0o700


@needs_owners
def test_what_somebody_planted_is_not_run(tmp_path: Path) -> None:
    """Index files are pickles: whoever writes one into a folder that is open to all would run code here."""
    program = """
import json, sys
from mjwrap.kernels.compilation import cache_folders, module_caches
print(json.dumps([str(cache_folders.base()), module_caches.new_place("mjwrap.kernels.layout").folder.name]))
"""
    shared = tmp_path / "shared"
    (shared / "mjwrap").mkdir(parents=True)
    (shared / "mjwrap").chmod(0o777)
    kept = {key: value for key, value in os.environ.items() if not key.startswith("NUMBA")}
    kept |= {"NUMBA_CACHE_DIR": str(shared), "XDG_CACHE_HOME": str(tmp_path / "xdg")}
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, env=kept
    )
    base, version = json.loads(done.stdout)
    assert Path(base) == tmp_path / "xdg" / "mjwrap"
    assert len(done.stderr.splitlines()) == 1
    assert str(shared / "mjwrap") in done.stderr
    assert version.startswith("mjwrap.kernels.layout-")


# --------------------------------------------------------------------------------------- what goes away


def version(base: Path, name: str, days: float) -> Path:
    """Make the folder of a version that was last used some days ago."""
    folder = base / name
    folder.mkdir(parents=True)
    (folder / "code.nbc").touch()
    then = time.time() - days * DAY
    for path in (folder / "code.nbc", folder):
        os.utime(path, (then, then))
    return folder


def some(module: str, number: int) -> str:
    return f"{module}-{number:016x}"


def test_versions_not_used_for_long_are_removed_but_the_newest(tmp_path: Path) -> None:
    ages = [1, 20, 40, 50, 60]
    mine = [version(tmp_path, some("mjwrap.kernels.span", n), days) for n, days in enumerate(ages)]
    others = [version(tmp_path, some("mjwrap.kernels.spanner", n), 99) for n in range(4)]
    foreign = [version(tmp_path, name, 99) for name in ("matplotlib", "mjwrap.kernels.span-draft", "notes")]
    cache_folders.make_version(tmp_path / some("mjwrap.kernels.span", 99))
    assert [folder.is_dir() for folder in mine] == [True, True, False, False, False]
    assert all(folder.is_dir() for folder in others + foreign)
    cache_folders.make_version(tmp_path / some("mjwrap.kernels.spanner", 99))
    assert [folder.is_dir() for folder in others].count(True) == 2  # with the new one three, however old
    assert not list(tmp_path.glob("*.gone-*"))


def test_none_that_was_used_of_late_is_removed(tmp_path: Path) -> None:
    folders = [version(tmp_path, some("mjwrap.kernels.span", n), 29) for n in range(20)]
    cache_folders.make_version(tmp_path / some("mjwrap.kernels.span", 99))
    assert all(folder.is_dir() for folder in folders)


def test_use_is_noted_once_a_day(tmp_path: Path) -> None:
    folder = version(tmp_path, some("mjwrap.kernels.span", 1), 40)
    cache_folders.use(folder)
    noted = folder.stat().st_mtime
    assert noted > time.time() - 60.0
    os.utime(folder, (noted - 0.5 * DAY, noted - 0.5 * DAY))
    cache_folders.use(folder)
    assert folder.stat().st_mtime == pytest.approx(noted - 0.5 * DAY, abs=1.0)
    cache_folders.use(tmp_path / "never made")


def test_what_older_versions_left_is_removed(tmp_path: Path) -> None:
    """They had one folder for everything, in which those of numba show when it was used."""
    old, recent = version(tmp_path, "0123456789abcdef", 40), version(tmp_path, "fedcba9876543210", 40)
    for folder, days in ((old, 35), (recent, 3)):
        version(folder, "kernels_some", days)
        then = time.time() - 40 * DAY
        os.utime(folder, (then, then))
    left = version(tmp_path, f"{some('mjwrap.kernels.span', 1)}.gone-01234567", 31)
    cache_folders.make_version(tmp_path / some("mjwrap.kernels.span", 2))
    assert (old.is_dir(), recent.is_dir(), left.is_dir()) == (False, True, False)


def test_processes_that_prune_at_once_and_folders_that_cannot_be_removed_do_no_harm(tmp_path: Path) -> None:
    for n in range(30):
        version(tmp_path, some("mjwrap.kernels.span", n), 40 + n)
    program = f"""
import pathlib, sys
from mjwrap.kernels.compilation import cache_folders
cache_folders.make_version(pathlib.Path({str(tmp_path)!r}) / ("mjwrap.kernels.span-" + sys.argv[1] * 16))
"""
    running = [subprocess.Popen([sys.executable, "-c", program, digit]) for digit in "abcd"]
    assert [process.wait() for process in running] == [0] * 4
    left = sorted(path.name for path in tmp_path.iterdir())
    assert {f"mjwrap.kernels.span-{digit * 16}" for digit in "abcd"} <= set(left)
    assert len(left) <= 4 + 2


def test_a_folder_taken_into_use_in_the_meantime_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folders = [version(tmp_path, some("mjwrap.kernels.span", n), 40 + n) for n in range(4)]
    listed = cache_folders._last_use

    def used_meanwhile(folder: Path) -> float:
        found = listed(folder)
        cache_folders.use(folder)  # by another process, after it was listed
        return found

    monkeypatch.setattr(cache_folders, "_last_use", used_meanwhile)
    cache_folders.make_version(tmp_path / some("mjwrap.kernels.span", 99))
    assert all(folder.is_dir() for folder in folders)
