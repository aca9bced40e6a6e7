"""Reading the run in an MCAP file, complete or cut off."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from shlex import quote

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray
from kinfmu.errors import LogError, listed
from kinfmu.log.cdr import NANOSECONDS, Template, nanoseconds
from kinfmu.log.mcap_reader import McapReader
from kinfmu.log.record import events_of, lists_in, run_of, samples_of, whole_number
from kinfmu.log.topics import LOG_TOPIC, SAMPLE_TOPIC, event_in, sample_template
from kinfmu.log.writing import (
    ABOUT,
    CHECKSUM,
    END,
    INFO,
    MECHANISM_FILE,
    MODEL_DESCRIPTION,
    RECORD,
    checksum,
    write_mcap,
)
from kinfmu.run import MOST_SAMPLES, Event, Run


def read(path: str | Path) -> Run:
    """Return the run in an MCAP file, bit for bit as it was written.

    Args:
        path: A file of `write_mcap`, `McapLog` or `kinfmu simulate`.

    Raises:
        LogError: The file is not a record of kinfmu, cannot be read, or is damaged or cut off, with the place.

    """
    with _os_errors_as_log_errors(path):
        reader = McapReader(Path(path))
        if reader.fault:
            raise LogError(f"{path}: not a whole MCAP file: {reader.fault}{_advice(reader, path)}")
        try:
            return _run_in(reader)[0]
        except LogError as error:
            raise LogError(f"{path}: {error}{_advice(reader, path)}") from None


def recover(path: str | Path, output: str | Path) -> Run:
    """Write what is left of a file that was cut off or damaged as a complete file.

    An event of level "warning" states where the samples end and why.

    Args:
        path: The damaged MCAP file.
        output: The MCAP file to write.

    Returns:
        The run in `output`.

    Raises:
        LogError: `path` holds no beginning of a run, or a file cannot be read or written.

    """
    with _os_errors_as_log_errors(path):
        reader = McapReader(Path(path))
        try:
            run, fault = _run_in(reader, is_cut=True)
        except LogError as error:
            raise LogError(f"{path}: nothing can be recovered: {reader.fault or error}") from None
    if fault:
        end = float(run.t[-1]) if len(run) else 0.0
        run = replace(run, events=(*run.events, Event(end, "warning", f"the record ends here: {fault}")))
    write_mcap(run, output)
    return run


@contextmanager
def _os_errors_as_log_errors(path: str | Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise LogError(f"{path}: cannot be read ({error.strerror or error})") from None


def _advice(reader: McapReader, path: str | Path) -> str:
    """Return the next command for a file that holds the beginning of a run, else ''."""
    is_begun = RECORD in reader.metadata and reader.id_of(SAMPLE_TOPIC) is not None
    return f"; kinfmu recover {quote(str(path))} keeps what is left" if is_begun else ""


def _run_in(reader: McapReader, *, is_cut: bool = False) -> tuple[Run, str]:
    """Return the run in a file; if is_cut, what is left of it, and why there is no more."""
    channel = reader.id_of(SAMPLE_TOPIC)
    if RECORD not in reader.metadata or channel is None:
        topics = listed(sorted(one.topic for one in reader.channels.values()))
        raise LogError(f"no topic {SAMPLE_TOPIC}, so this is not a run of kinfmu; topics: {topics}")
    texts, info, end = (reader.metadata.get(name, {}) for name in (RECORD, INFO, END))
    try:
        attachments = {name: reader.attachments.get(name, b"").decode() for name in (MECHANISM_FILE, MODEL_DESCRIPTION)}
    except UnicodeDecodeError:
        attachments = {}
    if texts.pop(CHECKSUM, "") != checksum(texts, info, attachments):
        raise LogError("metadata or mechanism are damaged (wrong checksum)")
    if end and end.pop(CHECKSUM, "") != checksum(end):
        end = {}
    if not (end or is_cut):
        raise LogError(f"metadata '{END}', written at the end of a run, are missing or damaged")
    about = lists_in(texts)
    count = samples_of(end) if end else MOST_SAMPLES
    events = events_of(end) if end else ()
    blocks, fault = _samples(reader, channel, sample_template(len(about["columns"])), count, is_cut=is_cut)
    samples = sum(map(len, blocks))
    if end and samples != count:
        fault = fault or f"holds {samples} of {count} samples"
    if fault and not is_cut:
        raise LogError(fault)
    run = run_of(about, blocks, events, info, attachments[MECHANISM_FILE], attachments[MODEL_DESCRIPTION])
    return run if end else replace(run, events=_logged_events(reader, run.t)), fault


def _samples(
    reader: McapReader, channel: int, template: Template, count: int, *, is_cut: bool
) -> tuple[list[NDArray[np.uint64]], str]:
    """Return rows of samples as blocks, in order of their numbers, and why there are no more.

    count: the largest number of samples; it bounds the memory.
    """
    blocks: list[NDArray[np.uint64]] = []
    numbers: list[NDArray[np.uint32]] = []
    fault, found = reader.fault, 0
    try:
        for block in reader.blocks(channel, template.length):
            found += len(block.sequence)
            if found > count:
                raise LogError(f"holds more than {count} samples")
            if block.payloads.shape[1] != template.length:
                raise LogError(f"a sample has {block.payloads.shape[1]} bytes instead of {template.length}")
            blocks.append(template.read(block.payloads))
            numbers.append(block.sequence.copy())  # a view would keep the whole chunk
    except LogError as error:
        if not is_cut:
            raise
        fault = str(error)
    sequence = np.concatenate(numbers) if numbers else np.empty(0)
    if np.array_equal(sequence, np.arange(len(sequence))):
        return blocks, fault
    order = np.argsort(sequence, kind="stable")  # another program has sorted them differently, or some are missing
    known = int(np.argmin(np.append(sequence[order] == np.arange(len(order)), False)))
    return [np.concatenate(blocks)[order[:known]]], fault or (
        "" if known == len(order) else f"sample {known} is missing"
    )


def _logged_events(reader: McapReader, t: FloatArray) -> tuple[Event, ...]:
    """Return the run's events from the log topic; events logged with a sample get its exact time."""
    channel = reader.id_of(LOG_TOPIC)
    about = reader.metadata.get(ABOUT, {})
    if channel is None:
        return ()
    zero = whole_number(about, "time_zero_s")
    events = []
    times = dict(zip((nanoseconds(t) - zero * NANOSECONDS).tolist(), t.tolist(), strict=True))
    try:
        for block in reader.blocks(channel):
            for stamp, payload in zip(block.times.tolist(), block.payloads, strict=True):
                event = event_in(payload.tobytes(), times.get(stamp, zero + stamp / NANOSECONDS))
                if event:
                    events.append(event)
    except (LogError, ValueError, IndexError, struct.error):
        pass  # events after a damaged message are lost; reading the samples reports where the file is damaged
    return tuple(events)
