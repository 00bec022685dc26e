"""Chunks of frames in parallel threads."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor


def in_threads(run: Callable[[int], None], begins: Iterable[int], jobs: int) -> None:
    """Call a function with the first frame of every chunk, in `jobs` threads."""
    if jobs == 1:
        for begin in begins:
            run(begin)
        return
    with ThreadPoolExecutor(jobs) as pool:
        for _ in pool.map(run, begins):
            pass
