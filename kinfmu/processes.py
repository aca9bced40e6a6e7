"""Threads and processes that work for this one, and how many of them are worth starting."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeVar

from kinfmu.errors import KinfmuError, RequestError

if TYPE_CHECKING:
    from concurrent.futures import Executor

_Part = TypeVar("_Part")
_Result = TypeVar("_Result")


class WorkerLostError(KinfmuError):
    """A process ended before its work was done."""


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def require_workers(workers: object) -> None:
    """Raise a RequestError for a number of workers that is no positive whole number."""
    if isinstance(workers, bool) or not (isinstance(workers, int) and workers > 0):
        raise RequestError(f"workers = {workers!r} must be a positive whole number")


def in_threads(work: Callable[[_Part], _Result], parts: Sequence[_Part], threads: int) -> list[_Result]:
    """Return the results of a function for some parts, computed by so many threads."""
    if threads <= 1 or len(parts) <= 1:
        return [work(part) for part in parts]
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(work, parts))


@contextmanager
def processes(count: int, begin: Callable[..., None] | None = None, *arguments: Any) -> Iterator[Executor]:
    """Start processes, and end them with the block.

    Args:
        count: How many.
        begin: Called with the arguments in each of them; functions of modules, as all that they call.
        *arguments: Arguments of `begin`.

    Yields:
        The executor. Submit work within `without_main`.

    Raises:
        WorkerLostError: A process was killed, or there was too little memory.

    """
    from concurrent.futures.process import BrokenProcessPool, ProcessPoolExecutor
    from multiprocessing import get_context

    pool = ProcessPoolExecutor(count, get_context("spawn"), initializer=_begin, initargs=(begin, arguments))
    try:
        yield pool
    except BrokenProcessPool:
        raise WorkerLostError(
            "a worker process ended unexpectedly: it was killed, or there is too little memory"
        ) from None
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def without_main() -> Iterator[None]:
    """Hide the script that runs, which a new process would run once more: all that workers call is in modules."""
    script = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = script


def _begin(begin: Callable[..., None] | None, arguments: tuple[Any, ...]) -> None:
    """Leave Ctrl-C to the parent, and end with it however it ends."""
    import multiprocessing
    import signal
    import threading
    from multiprocessing.connection import wait

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        sentinel = parent.sentinel

        def end() -> None:
            wait([sentinel])
            os._exit(1)  # a pool's workers would wait for a parent that was killed forever

        threading.Thread(target=end, daemon=True).start()
    if begin is not None:
        begin(*arguments)
