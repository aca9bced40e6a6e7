"""`study`: measure many designs, in this process, on all cores or on a cluster, and go on where a study was ended."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, wait
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from kinfmu import VERSION
from kinfmu.design.study.definition import SAMPLES, SEED, Study, define
from kinfmu.design.study.job import Job, nominal, run_chunk
from kinfmu.design.study.parts import PartsFolder, check_replaceable, remove_finished, write_synced
from kinfmu.design.study.result import StudyResult
from kinfmu.design.study.rows import study_in
from kinfmu.design.study.sampling import METHODS
from kinfmu.design.study.table import (
    CSV,
    FORMATS,
    PARQUET,
    MemoryTable,
    Rows,
    TableLayout,
    about_file,
    joined,
    part_bytes,
    require_parquet,
    stacked,
    write_csv,
    write_parquet,
)
from kinfmu.errors import MechanismError, MissingPackageError, RequestError, StudyError, listed
from kinfmu.files import errors_of_writing, replacement, suffix_of, temporary_folder
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.measures import Reading
from kinfmu.processes import WorkerLostError, cores, processes, require_workers, without_main

Progress = Callable[[int, int], None]


def study(
    mechanism: Mechanism | str | Path,
    parameters: Mapping[str, Mapping[str, Any]],
    *,
    measures: Iterable[Reading | str] | None = None,
    sampling: str = METHODS[0],
    designs: int = SAMPLES,
    seed: int = SEED,
    t: ArrayLike | None = None,
    engine: str = "auto",
    output: str | Path | None = None,
    workers: int | None = None,
    dask: str | None = None,
    restart: bool = False,
    progress: Progress | None = None,
    **inputs: ArrayLike,
) -> StudyResult:
    """Measure many designs of a mechanism: parameters on a grid, in ranges, or with tolerances.

    The numbers of a design follow from the seed and the number of the design alone, whoever measures it. With `output`,
    finished parts are kept in a folder next to the file, and a study that was ended goes on from there.

    Args:
        mechanism: The mechanism, a name of the gallery, or a mechanism file.
        parameters: For each parameter or law constant that varies, by name, one of the tables
            {"values": ["18 mm", 20]}, a grid; {"from": 1, "to": 2, "count": 5}, a grid; {"from": 1, "to": 2}, sampled;
            {"tolerance": 0.1, "distribution": "normal", "deviations": 3}, sampled about the value of the mechanism with
            a standard deviation of a third of the tolerance; or "uniform". All points of the grids are combined, each
            with the same samples.
        measures: Measures such as `kinfmu.measures.Range("stroke", of="slider.x")`, or names of those of the mechanism.
            Default: those of the mechanism.
        sampling: 'sobol', scrambled Sobol points, or 'latin_hypercube'.
        designs: Number of samples. Powers of two suit Sobol points.
        seed: Of the random numbers.
        t: (n,) times [s] for the laws of the file. Default, without inputs: one cycle of a single driver that turns all
            the way round, at each design's own speed if that varies, else the run of the file.
        engine: 'python', 'native' (generated C) or 'auto', which is native from some hundred designs on.
        output: The file of the results, .parquet, or .csv with a file FILE.json next to it. Default: none is kept.
        workers: Processes on this machine; 1: this process. Default: one for each core.
        dask: Address of a Dask scheduler, such as 'tcp://host:8786', whose workers have kinfmu installed; 'local': a
            cluster on this machine. Default: processes.
        restart: Begin again, without the parts that an earlier run or another study left, and replace the file of the
            results, whatever it holds.
        progress: Called with the number of designs that are done and of all.
        **inputs: Driver values in place of t, such as crank_angle=(n,) [rad] and crank_speed=, as in `kinfmu.solve`.

    Returns:
        The results: a row for each design.

    Raises:
        RequestError: An argument is invalid.
        StudyError: The parts or the file on disk belong to another study, workers end unexpectedly, or a file cannot be
            written.
        KinfmuError: The design as written cannot be planned.
        MissingPackageError: `distributed`, or for Parquet `pyarrow`, is not installed.

    """
    how: dict[str, Any] = {"sampling": sampling, "designs": designs, "seed": seed, "engine": engine}
    try:
        defined = define(mechanism, parameters, measures=measures, t=t, inputs=inputs, **how)
    except MechanismError as error:
        if isinstance(mechanism, Mechanism):
            raise RequestError(str(error), **error.data) from None
        raise
    return run_study(defined, output, workers=workers, dask=dask, restart=restart, progress=progress)


def run_study(
    study: Study,
    output: str | Path | None = None,
    *,
    workers: int | None = None,
    dask: str | None = None,
    restart: bool = False,
    progress: Progress | None = None,
) -> StudyResult:
    """Run a study, or go on with it; arguments as in `study`."""
    if workers is None:
        workers = cores()
    require_workers(workers)
    show = progress or (lambda _done, _count: None)
    if output is None:
        with temporary_folder() as folder, PartsFolder(folder / "study", study) as parts:
            layout, rows = _measured(study, parts, workers, dask, show)
            table = stacked(rows)
        return StudyResult(MemoryTable(layout, lambda: table))
    if not isinstance(output, str | Path):
        raise RequestError(f"output = {output!r} must be the path of a file, {listed(FORMATS)}")
    path = Path(output)
    if suffix_of(path) not in FORMATS:
        raise RequestError(f"{path}: the name of the results must end in {listed(FORMATS)}")
    if suffix_of(path) == PARQUET:  # else the study would end after its last part
        require_parquet(f"{path}: writing Parquet")
    there = study_in(path)
    if restart or there.get("fingerprint") != study.fingerprint:
        if not restart:
            check_replaceable(path, study, there)
        _run(study, path, workers, dask, show, restart=restart)
    else:
        remove_finished(path, study)
    return StudyResult.read(path)


def _run(study: Study, path: Path, workers: int, dask: str | None, progress: Progress, *, restart: bool) -> None:
    """Measure the parts that are missing, and join all parts in a file."""
    with PartsFolder(path, study, restart=restart) as parts:
        layout, rows = _measured(study, parts, workers, dask, progress)
        with errors_of_writing(path, StudyError), replacement(path) as temporary:
            if suffix_of(path) == CSV:
                write_csv(rows, layout, temporary)
                write_synced(about_file(path), layout.as_json().encode())
            else:
                write_parquet(rows, layout, temporary)
        parts.remove()


def _measured(
    study: Study, parts: PartsFolder, workers: int, dask: str | None, progress: Progress
) -> tuple[TableLayout, Iterator[Rows]]:
    """Measure the parts that are missing; return the layout of the table, and the rows of all parts."""
    job = Job.of(study)
    layout = TableLayout.of(study, nominal(study, job))
    missing = parts.missing()
    size = study.part_size
    done = sum(min(size, len(study) - first) for first in set(study.parts) - set(missing))
    progress(done, len(study))
    packed = job.packed()

    def arguments(first: int) -> tuple[Any, ...]:
        return packed, VERSION, study.part(first)

    for first, columns in results(run_chunk, arguments, missing, workers, dask):
        parts.write(first, part_bytes(layout.rows(first, columns)))
        done += min(size, len(study) - first)
        progress(done, len(study))
    return layout, joined(layout, ((k, min(size, len(study) - k), parts.path(k)) for k in study.parts))


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
