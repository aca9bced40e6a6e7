"""Who measures the parts of a study: this process, processes of this machine, or a Dask cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, wait
from contextlib import contextmanager
from typing import Any

from kinfmu import VERSION
from kinfmu.errors import MissingPackageError, StudyError
from kinfmu.processes import WorkerLostError, processes, without_main

AHEAD = 3  # parts given to each core before they are due; more would only fill the memory
LOCAL = "local"

Call = Callable[..., Any]


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
    if not parts:  # a study that was ended before its parts were joined
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
            with without_main():
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
    try:
        with processes(count) as pool:
            yield pool, count
    except WorkerLostError as error:
        raise StudyError(f"{error}; finished parts are kept, and the same command goes on from there") from None


@contextmanager
def _cluster(address: str, workers: int) -> Iterator[tuple[Executor, int]]:
    try:
        import distributed
    except ImportError:
        raise MissingPackageError("--dask needs distributed: pip install 'kinfmu[dask]'") from None

    cluster = None
    try:
        if address == LOCAL:
            with without_main():
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
    except distributed.KilledWorker as error:
        raise StudyError(f"Dask workers ended several times at the same part: {error}") from None
    except (CancelledError, TypeError, ValueError) as error:
        if not (isinstance(error, CancelledError) or _is_from_executor(error)):
            raise
        raise StudyError(
            "the Dask cluster was lost; the same command goes on with the parts that are missing"
        ) from None
    finally:
        if cluster is not None:
            cluster.close()


def _is_from_executor(error: Exception) -> bool:
    """Return whether an error is one of Dask's executor itself: it expects the error of a task where there is none.

    This happens where the connection is lost between two looks of the executor at a task.
    """
    traceback = error.__traceback__
    while traceback is not None and traceback.tb_next is not None:
        traceback = traceback.tb_next
    return traceback is not None and traceback.tb_frame.f_globals.get("__name__") == "distributed.cfexecutor"
