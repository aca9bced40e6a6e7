"""MCAP: the permanent record of a run, which ROS 2 viewers draw without set-up.

    /sample               kinfmu_msgs/msg/Sample                 the full record, in the mechanism's own units
    /joint_states         sensor_msgs/msg/JointState             positions and speeds [m, rad, s]
    /joint_accelerations  sensor_msgs/msg/JointState             accelerations, in `position` [m, rad, s]
    /robot_description    std_msgs/msg/String, URDF              the links, once
    /tf                   tf2_msgs/msg/TFMessage                 where they are [m]
    /log                  rcl_interfaces/msg/Log                 changes of status and events

The drawn topics hold what a screen can show of the samples: `drawn_samples`. They are written when the run has ended.
Samples without numbers (status 3 to 5) are a gap in the drawn topics; the full record keeps every sample unchanged, so
`read` returns the same run, bit for bit. The mechanism file and the FMU's model description are attachments.
Metadata: kinfmu.record (names, units, constants), kinfmu.info (of the run: token, parameters), kinfmu.about (versions,
meaning of the times), and at the end kinfmu.end (number of samples, events, verdict, why a run ended early).
"""

from __future__ import annotations

import platform
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from io import FileIO
from pathlib import Path

import numpy as np

from kinfmu.arrays import IntArray
from kinfmu.errors import MechanismError
from kinfmu.log.cdr import NANOSECONDS, check_times, nanoseconds, zero_of
from kinfmu.log.mcap_writer import McapWriter
from kinfmu.log.record import computed_when_read, description, ending
from kinfmu.log.target import replacing
from kinfmu.log.topics import SOURCE, STATUS_SOURCE, JointTopic, LinkTopic, LogTopic, SampleTopic, joint_topics
from kinfmu.run import Event, Run
from kinfmu.run.axis import axis_of
from kinfmu.run.channels import is_all_but, is_drawn, kept_samples, select
from kinfmu.run.verdict import changed_samples, sentence, status_events, unexplained
from kinfmu.version import VERSION

LOOKED_AT = 2**18  # samples at once, to choose those that are drawn
ROWS = 4096  # samples in a chunk of a complete run; larger chunks take more memory, smaller ones more time
FRAMES = 60.0  # samples drawn per second of playing
PLAYED_SLOWLY = 40.0  # [s]; shorter runs are drawn as if they lasted so long: a plot may be 2400 pixels wide
MOST_DRAWN = 20_000  # of a run; they take twice the bytes of those in /sample
LARGEST_CHUNK = 2**26  # [bytes]; readers refuse what unpacks to more than twice that
MECHANISM_FILE = "mechanism.toml"
MODEL_DESCRIPTION = "modelDescription.xml"
RECORD, INFO, ABOUT, END = "kinfmu.record", "kinfmu.info", "kinfmu.about", "kinfmu.end"  # metadata
CHECKSUM = "checksum"  # of metadata and attachments; chunks have their own


def write_mcap(run: Run, path: str | Path, *, channels: Sequence[str] | None = None, rate: float | None = None) -> None:
    """Write `run` to one MCAP file (zstd chunks); log times are nanoseconds of simulation time.

    Args:
        run: The run.
        path: The file; an older one is replaced when the new one is complete.
        channels: What to keep of every sample, such as ["q", "drawn"] or ["-error"]; see kinfmu.run.channels. Default:
            everything. ["-drawn"] keeps the record alone, less than half as large. Margins and errors that were not
            read from the run yet are written if they are named, or by 'all'; else `read` returns a run that computes
            them when they are read.
        rate: Samples to keep per second of the run. Default: all.

    Raises:
        LogError: The file cannot be written, or a time is outside the range of a log.
        RequestError: Invalid channels or rate.

    """
    run = select(run, channels, rate)
    if not is_all_but(channels):
        run = run.replaced(margin=run.margin, error=run.error)
    check_times(run.t)  # before a file is made
    with replacing(path) as temporary, FileIO(temporary, "w") as file:
        content = Content(file, run, zero_of(run.t), drawn=is_drawn(channels))
        try:
            for part in _chunks(run):
                content.add(part)
            content.log(unexplained(status_events(run), run.events), run.events)
            content.end(run)
        finally:
            content.close()


def _chunks(run: Run) -> Iterator[Run]:
    """Yield the samples of a run in the parts that are written at once."""
    rows = max(1, min(ROWS, LARGEST_CHUNK // (64 + 8 * sum(1 for _ in run.places()))))
    for start in range(0, len(run), rows):
        yield run.part(slice(start, start + rows))


def drawn_samples(run: Run) -> IntArray:
    """Return the samples that viewers draw: FRAMES per second at most, and MOST_DRAWN in all, evenly spaced in time.

    A short run is played slowly. Also the first and last one, those next to events such as limits, and both sides of
    each change of status.
    """
    if not len(run):
        return np.arange(0)
    changed = changed_samples(run)
    events = np.searchsorted(run.t, [event.t for event in run.events]).clip(max=len(run) - 1)
    marked = _decimated(np.unique([0, len(run) - 1, *(changed - 1), *changed, *events]), MOST_DRAWN // 2)
    most = MOST_DRAWN - len(marked)
    starts = range(0, len(run), LOOKED_AT)
    span = float(np.ptp(run.t)) or 1.0
    rate = min(FRAMES * max(1.0, PLAYED_SLOWLY / span), (most - 2 * len(starts)) / span)
    even = [start + kept_samples(run.t[start : start + LOOKED_AT], rate) for start in starts]
    return np.union1d(marked, _decimated(np.concatenate(even), most))


def _decimated(rows: IntArray, most: int) -> IntArray:
    """Return rows, or so many of them, evenly spaced, if there are more."""
    return rows if len(rows) <= most else rows[np.linspace(0, len(rows) - 1, most).astype(int)]


class Content:
    """The content of an MCAP file that is being written.

    run: the run at its beginning, with or without samples; zero: origin of log times [s]; at_once: True if samples are
    in the file when `add` returns.
    """

    def __init__(self, file: FileIO, run: Run, zero: int, *, drawn: bool = True, at_once: bool = False) -> None:
        writer = self._writer = McapWriter(file, profile="ros2", library=f"kinfmu {VERSION}", at_once=at_once)
        self._zero = zero
        texts, info = description(run), dict(run.info)
        attachments = {MECHANISM_FILE: run.mechanism_text, MODEL_DESCRIPTION: run.model_description}
        writer.metadata(RECORD, texts | {CHECKSUM: checksum(texts, info, attachments)})
        writer.metadata(INFO, info)
        for (name, text), kind in zip(attachments.items(), ("toml", "xml"), strict=True):
            if text:
                writer.attachment(name, f"application/{kind}", text.encode())
        axis = axis_of(run)
        base = "simulation" if axis.is_time else "number of the sample, one a second"
        about = {"time_base": base, "axis": axis.label, "time_zero_s": str(zero), **_versions()}
        self.until = 0.0  # time of the last sample [s]
        self._sample = SampleTopic(writer, run.part(slice(0, 0)).without(computed_when_read(run)))
        self._topics: list[JointTopic | LinkTopic] = []
        self._log: LogTopic | None = None
        if drawn:
            self._topics += joint_topics(writer, run)
            try:
                if run.mechanism:
                    self._topics.append(LinkTopic(writer, run, run.mechanism))
            except MechanismError as error:
                about["linkage"] = f"not drawn: {error}"
            self._log = LogTopic(writer, zero)
        writer.metadata(ABOUT, about)

    @property
    def length(self) -> int:
        """Bytes of the whole records in the file."""
        return self._writer.length

    def add(self, run: Run) -> None:
        """Write the next samples."""
        stamps = nanoseconds(run.t) - self._zero * NANOSECONDS
        if not len(run):
            return
        self._sample.add(run, stamps)
        self.until = float(run.t[-1])

    def _draw(self, run: Run) -> None:
        """Write what viewers draw of the whole run."""
        for part in _chunks(run.part(drawn_samples(run))) if self._topics else ():
            stamps = nanoseconds(part.t) - self._zero * NANOSECONDS
            for topic in self._topics:
                topic.add(part, stamps)

    def log(self, changes: Iterable[Event], events: Iterable[Event]) -> None:
        """Write changes of status and the run's own events."""
        entries = [(STATUS_SOURCE, event) for event in changes] + [(SOURCE, event) for event in events]
        if self._log:
            self._log.add(sorted(entries, key=lambda entry: entry[1].t))

    def end(self, run: Run, outcome: str = "") -> None:
        """Write what is drawn of the run, its verdict, and finish the file.

        outcome: why the run ended early, if no event states that.
        """
        self._draw(run)
        failures = [event.text for event in run.events if event.level == "error"]
        texts = ending(run) | {"verdict": sentence(run), "outcome": outcome or (failures or ["completed"])[0]}
        self._writer.metadata(END, texts | {CHECKSUM: checksum(texts)})
        self._writer.finish()

    def continue_in(self, file: FileIO) -> None:
        """Continue at the end of `file`, which is the same file opened under another name."""
        self._writer.continue_in(file)

    def close(self) -> None:
        """Discard what is not in the file yet."""
        self._writer.close()


def checksum(*texts: Mapping[str, str]) -> str:
    """Return the CRC-32 of all names and texts, in hexadecimal."""
    parts = [part for table in texts for entry in table.items() for part in entry]
    return f"{zlib.crc32(chr(0).join(parts).encode()):08x}"


def _versions() -> dict[str, str]:
    """Return the versions of the software that writes the file."""
    return {
        "kinfmu": VERSION,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "platform": f"{platform.system()} {platform.machine()}",
    }
