"""Who measures the parts of a study: this process, processes of this machine, or a Dask cluster."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from types import ModuleType
from typing import Any

from kinfmu import VERSION
from kinfmu.errors import MissingPackageError, StudyError

AHEAD = 3  # parts given to each core before they are due; more would only fill the memory
LOCAL = "local"

Call = Callable[..., Any]


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def results(
    call: Call, arguments: Callable[[int], tuple[Any, ...]], parts: Sequence[int], workers: int, dask: str | None
) -> Iterator[tuple[int, Any]]:
    """Yield each part with what `call(*arguments(part))` returns, in the order in which they are done.

    Args:
        call: A function of a module.
        arguments: Its arguments for a part.
        parts: The parts to do.
        workers: Number of processes on this machine; 1: this process.
        dask: Address of a Dask scheduler, or 'local' for a cluster on this machine; None: no Dask.

    Raises:
        StudyError: Workers end unexpectedly, or the cluster cannot be reached.
        MissingPackageError: `distributed` is not installed.

    """
    if dask is None and (workers == 1 or len(parts) == 1):
        for part in parts:
            yield part, call(*arguments(part))
        return
    with _cluster(dask, workers) if dask is not None else _processes(min(workers, len(parts))) as (pool, count):
        yield from _in_pool(pool, count * AHEAD, call, arguments, parts)


def _in_pool(
    pool: Executor, ahead: int, call: Call, arguments: Callable[[int], tuple[Any, ...]], parts: Sequence[int]
) -> Iterator[tuple[int, Any]]:
    """Yield results as they are done, with at most so many parts under way."""
    waiting, under_way = iter(parts), dict[Future[Any], int]()
    while True:
        for part in waiting:
            with _without_main():
                under_way[pool.submit(call, *arguments(part))] = part
            if len(under_way) >= ahead:
                break
        if not under_way:
            return
        done, _ = wait(under_way, return_when=FIRST_COMPLETED)
        for future in done:
            yield under_way.pop(future), future.result()


@contextmanager
def _processes(count: int) -> Iterator[tuple[Executor, int]]:
    import multiprocessing

    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(count, mp_context=context, initializer=_begin_worker)
    try:
        yield pool, count
    except BrokenProcessPool:
        reason = "a worker process ended unexpectedly: it was killed, or there is too little memory"
        raise StudyError(f"{reason}; finished parts are kept, and the same command goes on from there") from None
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _begin_worker() -> None:
    """Leave Ctrl-C to the parent, and end with it however it ends."""
    import multiprocessing
    from multiprocessing.connection import wait as wait_for

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is None:
        return
    sentinel = parent.sentinel

    def end() -> None:
        wait_for([sentinel])
        os._exit(1)  # a pool's workers would wait for a parent that was killed forever

    threading.Thread(target=end, daemon=True).start()


@contextmanager
def _cluster(address: str, workers: int) -> Iterator[tuple[Executor, int]]:
    try:
        import distributed
    except ImportError:
        raise MissingPackageError("--dask needs distributed: pip install 'kinfmu[dask]'") from None

    cluster = None
    try:
        if address == LOCAL:
            with _without_main():
                cluster = distributed.LocalCluster(
                    n_workers=workers, threads_per_worker=1, dashboard_address=None, silence_logs=50
                )
        client = distributed.Client(cluster or address, timeout="10s")
    except (OSError, ValueError) as error:  # a scheduler that does not answer, an address of another form
        if cluster is not None:
            cluster.close()
        raise StudyError(
            f"the Dask scheduler at '{address}' cannot be reached ({error or type(error).__name__})"
        ) from None
    try:
        with client:
            yield client.get_executor(pure=False), max(1, sum(client.ncores().values()))
    except ModuleNotFoundError as error:
        raise StudyError(f"the workers of the Dask cluster need kinfmu {VERSION} ({error}): install it there") from None
    except CancelledError:
        raise StudyError(
            "the Dask cluster was lost; the same command goes on with the parts that are missing"
        ) from None
    except distributed.KilledWorker as error:
        raise StudyError(f"Dask workers ended several times at the same part: {error}") from None
    finally:
        if cluster is not None:
            cluster.close()


@contextmanager
def _without_main() -> Iterator[None]:
    """Hide the script that runs, which a new process would run once more: all that workers call is in modules."""
    script = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = script
