"""The engine plugin under unusual and wrong use, with tools that detect stray reads and writes.

Every scene runs in a process of its own, under faulthandler, in up to four ways:

- plain: as users run it;
- bounds: every index of the compiled code is checked (NUMBA_BOUNDSCHECK=1, with a cache of its own);
- fences: the arrays of a block lie between red zones, checked when the block is freed, and the block ends at a
  protected page; a stray write kills the process, a stray read finds NaN;
- malloc: glibc's debugging malloc, which fills new and freed memory and checks its own lists (if it is installed);
- valgrind: memcheck over the shorter scenes (if it is installed; --valgrind, minutes for each scene): errors with
compiled
  callbacks on their stack count.

A scene passes if its process ends with 0, prints nothing unexpected, and ends with the same bits as the plain run
(except under bounds and valgrind, which compile differently). Exit code 1 if one does not.
"""

from __future__ import annotations

import argparse
import ctypes
import gc
import hashlib
import itertools
import mmap
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import mujoco
import numpy as np
from plugin_scenes import SAYS, SCENES, SHORT

import mjwrap as mw
from mjwrap.plugin.blocks import allocation, image
from mjwrap.plugin.callbacks import block as bk
from mjwrap.plugin.mujoco_c.registration import address_of, keep_forever

ROOT = Path(__file__).resolve().parents[2]
RED, ZONE = 0x7FF8DEADBEEFF00D, 16  # a NaN, and how many words of it stand between two arrays
KILLED = re.compile(
    r"IndexError|Exception ignored|Traceback|red zone|Fatal Python error|Invalid (read|write)"
)


# ------------------------------------------------------------------------------------------------------- fences


def put_up_fences() -> None:
    """Give every block red zones between its arrays and a page behind it that nobody may touch."""
    plain, libc = image.block_image, ctypes.CDLL(None, use_errno=True)
    places: dict[int, list[int]] = {}  # by size of a block: where its red zones begin [bytes]
    held: dict[int, tuple[mmap.mmap, int]] = {}
    zone = np.full(ZONE, RED, dtype=np.uint64).tobytes()

    def fenced(*arguments: object) -> bytes:
        made = plain(*arguments)  # type: ignore[arg-type]
        head = np.frombuffer(made, dtype=np.int64, count=bk.HEAD).copy()
        starts = [*head[bk.A_ROUTES : bk.A_ROUTES + len(bk.ARRAYS)].tolist(), len(made)]
        parts, zones, here = [], [], 8 * bk.HEAD
        for k, (first, end) in enumerate(itertools.pairwise(starts)):
            head[bk.A_ROUTES + k] = here + len(zone)
            parts += [zone, made[first:end]]
            zones.append(here)
            here += len(zone) + end - first
        head[bk.BYTES] = here
        places[here] = zones
        return head.tobytes() + b"".join(parts)

    def allocate(size: int) -> int:
        pages = -(-size // mmap.PAGESIZE)
        room = mmap.mmap(-1, (pages + 1) * mmap.PAGESIZE)
        base = ctypes.addressof(ctypes.c_char.from_buffer(room))
        if libc.mprotect(ctypes.c_void_p(base + pages * mmap.PAGESIZE), mmap.PAGESIZE, 0):
            raise OSError(ctypes.get_errno(), "mprotect")
        block = base + pages * mmap.PAGESIZE - size
        held[block] = room, size
        return block

    def give_back(block: int, *_: object) -> None:
        room, size = held.pop(block)
        for place in places[size]:
            if ctypes.string_at(block + place, len(zone)) != zone:
                print(f"red zone at byte {place} of a block was written to", file=sys.stderr, flush=True)
        kept_rooms.append(room)  # its pages are never used again, so that a late access shows
        libc.mprotect(ctypes.c_void_p(block // mmap.PAGESIZE * mmap.PAGESIZE), size, 0)

    kept_rooms: list[mmap.mmap] = []
    free = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)(give_back)
    keep_forever(free)
    allocation.block_image, allocation.raw_malloc = fenced, allocate  # type: ignore[assignment]
    allocation.free_function = lambda: address_of(free)


def child(scene: str, fences: bool) -> int:
    """Run one scene; print a hash of where it ended."""
    mujoco.set_mju_user_warning(lambda text: None)
    if fences:
        put_up_fences()
    datas = SCENES[scene]()
    digest = hashlib.sha256()
    for data in datas:
        digest.update(data.qpos.tobytes() + data.plugin_state.tobytes())
    print("ended at", digest.hexdigest()[:16])
    del datas
    gc.collect()
    return 0


# ------------------------------------------------------------------------------------------------------- parent


def ways(valgrind: bool) -> dict[str, tuple[list[str], dict[str, str], list[str]]]:
    """Return by name: what to put before the command, the environment, and what behind it."""
    debug = Path("/lib/x86_64-linux-gnu/libc_malloc_debug.so.0")
    found: dict[str, tuple[list[str], dict[str, str], list[str]]] = {
        "plain": ([], {}, []),
        "bounds": ([], {"NUMBA_BOUNDSCHECK": "1"}, []),
        "fences": ([], {}, ["--fences"]),
    }
    if debug.exists():
        tunables = "glibc.malloc.check=3:glibc.malloc.perturb=165"
        found["malloc"] = [], {"LD_PRELOAD": str(debug), "GLIBC_TUNABLES": tunables}, []
    if valgrind and (tool := shutil.which("valgrind")):
        before = [tool, "--error-limit=no", "--num-callers=12", "--read-var-info=no", "-q"]
        environment = {"PYTHONMALLOC": "malloc", "NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
        found["valgrind"] = before, environment, []
    return found


def judge(done: subprocess.CompletedProcess[str], scene: str, way: str) -> str:
    """Return what is wrong with a finished process, or nothing."""
    if done.returncode:
        return f"ended with {done.returncode}"
    said = [line for line in done.stderr.splitlines() if line.strip()]
    if way == "valgrind":
        wrong = callbacks_at_fault(done.stderr)
        return f"{wrong} errors in compiled callbacks" if wrong else ""
    said = [line for line in said if not any(word in line for word in SAYS.get(scene, ()))]
    said = [line for line in said if "compiling its kernels" not in line]
    return "" if not said else "said: " + next((s for s in said if KILLED.search(s)), said[0])


def callbacks_at_fault(text: str) -> int:
    """Return how many of memcheck's errors happened in code without a file: machine code made at run time."""
    count = 0
    for report in re.split(r"\n==\d+== \n", text):
        first = re.search(r"(Invalid (?:read|write)|uninitialised)[^\n]*\n==\d+==    at ([^\n]*)", report)
        count += first is not None and "???" in first.group(2)
    return count


def run(command: list[str], environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """Run a command in an empty folder, where MuJoCo may write its log."""
    every = {**os.environ, "PYTHONPATH": str(ROOT), **environment}
    with tempfile.TemporaryDirectory() as folder:
        return subprocess.run(command, cwd=folder, env=every, capture_output=True, text=True)


def main() -> int:
    """Run all scenes in all ways; return the exit code."""
    parser = argparse.ArgumentParser(description="The engine plugin under hostile use.")
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--valgrind", action="store_true", help="memcheck too, over the shorter scenes")
    parser.add_argument("--child", choices=SCENES, help=argparse.SUPPRESS)
    parser.add_argument("--fences", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        return child(options.child, options.fences)
    print(f"mjwrap {mw.__version__}, MuJoCo {mujoco.__version__}")
    bad = 0
    for scene in options.scenes:
        ends: set[str] = set()
        for way, (before, environment, behind) in ways(options.valgrind).items():
            if way == "valgrind" and scene not in SHORT:
                continue
            command = [sys.executable, "-X", "faulthandler", __file__, "--child", scene, *behind]
            began = time.perf_counter()
            if before:
                run(command, environment)  # to compile, which would take hours under the tool
            done = run([*before, *command], environment)
            wrong = judge(done, scene, way)
            if way not in ("valgrind", "bounds"):
                ends.add(done.stdout.strip())
            bad += bool(wrong)
            print(
                f"{scene:12s} {way:9s} {time.perf_counter() - began:6.1f} s  {wrong or 'passed'}", flush=True
            )
            if wrong:
                print("    " + "\n    ".join((done.stdout + done.stderr).splitlines()[-12:]))
        if len(ends) > 1:
            bad += 1
            print(f"{scene:12s} ended elsewhere in another way: {', '.join(sorted(ends))}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
