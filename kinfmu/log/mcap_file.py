"""MCAP: the durable record of a run, which viewers of ROS 2 draw with no set-up.

    /robot_description    std_msgs/msg/String, URDF              the links, once
    /tf                   tf2_msgs/msg/TFMessage                 where they are [m]
    /joint_states         sensor_msgs/msg/JointState             positions and speeds [m, rad, s]
    /joint_accelerations  sensor_msgs/msg/JointState             accelerations, in `position` [m, rad, s]
    /log                  rcl_interfaces/msg/Log                 changes of status and events
    /sample               kinfmu_msgs/msg/Sample                 the full record, in the mechanism's own units

Samples without numbers (status 3 to 5) are a gap in the drawn topics; the full record keeps every sample as it is, so
`read` gives back the same run, bit for bit. The mechanism file is an attachment; names, units, constants are metadata.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinfmu.errors import LogError, listed
from kinfmu.log import ros2
from kinfmu.log.cdr import Bytes, Template
from kinfmu.log.clock import NANOSECONDS, nanoseconds, zero_of
from kinfmu.log.record import column_names, description, dtype_of, run_of, words
from kinfmu.log.scene import Scene, drawable
from kinfmu.log.target import replacing
from kinfmu.log.verdict import happenings, sentence
from kinfmu.naming import quantity_of
from kinfmu.run import Run
from kinfmu.units import METRES

if TYPE_CHECKING:
    from mcap.reader import McapReader
    from mcap.writer import Writer

CHUNK_SIZE = 64 * 1024  # [bytes]; a truncated file loses at most its last chunk
MOST_REASON = 160  # characters of a foreign error in a message
SAMPLE_TOPIC = "/sample"
MECHANISM_FILE = "mechanism.toml"
_RECORD, _INFO = "kinfmu.record", "kinfmu.info"  # names of metadata records
_CHECKSUM = "checksum"  # in the record; readers of MCAP check the chunks, but neither metadata nor attachments


def write_mcap(run: Run, path: str | Path) -> None:
    """Write `run` to one MCAP file (chunks of zstd), log times in nanoseconds of simulation time."""
    from mcap.writer import CompressionType, Writer

    times = nanoseconds(run.t)
    zero = zero_of(run.t)
    stamps = times - zero * NANOSECONDS  # (n,)
    scene, reason = drawable(run)
    with replacing(path) as temporary, temporary.open("wb") as file:
        writer = Writer(file, chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD)
        writer.start(profile="ros2", library="kinfmu")
        about = {"verdict": sentence(run), "time_base": "simulation", "time_zero_s": str(zero)}
        texts, info = description(run), dict(run.info)
        writer.add_metadata(_RECORD, texts | {_CHECKSUM: _checksum(texts, info, run.mechanism_text)})
        writer.add_metadata(_INFO, info)
        writer.add_metadata("kinfmu.about", about | ({"linkage": reason} if reason else {}))
        if run.mechanism_text:
            writer.add_attachment(0, 0, MECHANISM_FILE, "application/toml", run.mechanism_text.encode())
        topics = _Topics(writer)
        first = int(stamps[0]) if len(stamps) else 0
        metres = METRES[run.length_unit]
        tracks = [_sample_track(topics, run, stamps), *_joint_tracks(topics, run, stamps, metres)]
        if scene and (scene.bodies or scene.bars):
            urdf = ros2.robot_description(_name(run), scene, metres)
            topic = topics.add("/robot_description", "std_msgs/msg/String", ros2.STRING)
            topics.write(topic, first, Template().string(urdf).fill(stamps[:1] if len(stamps) else np.zeros(1, int))[0])
            tracks.append(_tf_track(topics, scene, stamps, metres))
        _write_in_order(topics, len(run), tracks)
        _write_log(topics, run, zero)
        writer.finish()


def read(path: str | Path) -> Run:
    """The run that `write_mcap` wrote to `path`, equal in every bit."""
    from mcap.reader import make_reader

    try:
        with Path(path).open("rb") as file:
            reader = make_reader(file, validate_crcs=True)
            return _run_in(reader, str(path))
    except LogError:
        raise
    except OSError as error:
        raise LogError(f"{path}: cannot be read ({error.strerror or error})") from None
    except Exception as error:  # damaged bytes make readers, decompressors and decoders raise whatever they meet
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:MOST_REASON]
        raise LogError(
            f"{path}: not a whole MCAP file ({reason}); it was cut off or damaged, or is something else"
        ) from error


def _run_in(reader: McapReader, where: str) -> Run:
    summary = reader.get_summary()
    channels = summary.channels.values() if summary else ()
    if not any(channel.topic == SAMPLE_TOPIC for channel in channels):
        topics = listed(sorted(channel.topic for channel in channels))
        raise LogError(f"{where}: no topic {SAMPLE_TOPIC}, so this is no run of kinfmu; topics: {topics}")
    metadata = {record.name: record.metadata for record in reader.iter_metadata()}
    if _RECORD not in metadata:
        raise LogError(f"{where}: metadata record {_RECORD} is missing; records: {listed(metadata)}")
    mechanisms = [one.data.decode() for one in reader.iter_attachments() if one.name == MECHANISM_FILE]
    payloads, order = [], []
    for _, _, message in reader.iter_messages(topics=[SAMPLE_TOPIC], log_time_order=False):
        payloads.append(message.data)
        order.append(message.sequence)
    texts, info = metadata[_RECORD], metadata.get(_INFO, {})
    mechanism_text = mechanisms[0] if mechanisms else ""
    if texts.pop(_CHECKSUM, "") != _checksum(texts, info, mechanism_text):
        raise LogError(f"{where}: metadata or mechanism are damaged (their checksum does not fit)")
    template = _sample_template(len(column_names(texts)))
    messages = np.frombuffer(b"".join(payloads), np.uint8).reshape(len(payloads), template.length)
    table = template.read(messages[np.argsort(order, kind="stable")])
    return run_of(texts, table, info, mechanism_text, where)


def _checksum(texts: Mapping[str, str], info: Mapping[str, str], mechanism_text: str) -> str:
    """CRC-32 of all names and texts, in hexadecimal."""
    parts = [part for table in (texts, info) for entry in table.items() for part in entry]
    return f"{zlib.crc32(chr(0).join([*parts, mechanism_text]).encode()):08x}"


class _Topics:
    """Channels of an MCAP file that is being written, and the number of messages in each."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._counts: dict[int, int] = {}

    def add(self, topic: str, schema: str, definition: str, metadata: dict[str, str] | None = None) -> int:
        schema_id = self._writer.register_schema(schema, "ros2msg", definition.encode())
        channel = self._writer.register_channel(topic, "cdr", schema_id, metadata or {})
        self._counts[channel] = 0
        return channel

    def write(self, channel: int, stamp: int, payload: Bytes) -> None:
        """One message at `stamp` [ns]."""
        number = self._counts[channel]
        self._writer.add_message(channel, stamp, payload.tobytes(), stamp, number)
        self._counts[channel] = number + 1


class _Track:
    """Messages of one topic: payload k stands at sample rows[k] of the run."""

    def __init__(self, channel: int, rows: NDArray[np.int64], stamps: NDArray[np.int64], payloads: Bytes) -> None:
        self.channel, self.rows, self.stamps, self.payloads = channel, rows, stamps, payloads


def _write_in_order(topics: _Topics, count: int, tracks: list[_Track]) -> None:
    """All tracks sample by sample, so that a stretch of time lies in neighbouring chunks."""
    places = [0] * len(tracks)
    for row in range(count):
        for k, track in enumerate(tracks):
            while places[k] < len(track.rows) and track.rows[places[k]] == row:
                topics.write(track.channel, int(track.stamps[places[k]]), track.payloads[places[k]])
                places[k] += 1


def _sample_template(columns: int) -> Template:
    return Template().stamp().words(columns)


def _sample_track(topics: _Topics, run: Run, stamps: NDArray[np.int64]) -> _Track:
    """The full record, every sample, in the mechanism's own units."""
    columns = list(run.columns())
    names = ros2.field_names(column.name for column in columns)
    kinds = ["int64" if dtype_of(column.name) == "<i8" else "float64" for column in columns]
    comments = [f"{column.name} [{column.unit}]" for column in columns]
    metadata = {f"unit.{name}": column.unit for name, column in zip(names, columns, strict=True)}
    metadata |= {f"column.{name}": column.name for name, column in zip(names, columns, strict=True)}
    definition = ros2.sample_definition(zip(kinds, names, comments, strict=True))
    channel = topics.add(SAMPLE_TOPIC, "kinfmu_msgs/msg/Sample", definition, metadata)
    payloads = _sample_template(len(columns)).fill(stamps, words(run))
    return _Track(channel, np.arange(len(run)), stamps, payloads)


def _joint_tracks(topics: _Topics, run: Run, stamps: NDArray[np.int64], metres: float) -> list[_Track]:
    """Positions and speeds, and accelerations, each with an empty message where a gap begins: it ends the curve."""
    to_si = np.array([1.0 if quantity_of(name).kind == "angle" else metres for name in run.outputs])
    rows = np.flatnonzero(run.good)
    gaps = np.flatnonzero(np.diff(run.good.astype(int)) == -1) + 1
    tracks = []
    for topic, tables in (
        ("/joint_states", (run.values, run.rates)),
        ("/joint_accelerations", (run.accelerations,)),
    ):
        units = {"units": f"position: {_si_units(run, 2 * (len(tables) == 1))}"}
        if len(tables) == 2:
            units["units"] += f"; velocity: {_si_units(run, 1)}"
        channel = topics.add(topic, "sensor_msgs/msg/JointState", ros2.JOINT_STATE, units)
        numbers = np.hstack([table[rows] * to_si for table in tables])
        template = _joint_state(run.outputs, len(tables) == 2)
        tracks.append(_Track(channel, rows, stamps[rows], template.fill(stamps[rows], numbers)))
        tracks.append(_Track(channel, gaps, stamps[gaps], _joint_state((), False).fill(stamps[gaps])))
    return tracks


def _joint_state(names: tuple[str, ...], with_velocity: bool) -> Template:
    template = Template().stamp().string(ros2.ROOT).strings(names).sequence(len(names))
    return template.sequence(len(names) if with_velocity else 0).sequence(0)


def _si_units(run: Run, order: int) -> str:
    kinds = {quantity_of(name).kind for name in run.outputs}
    per_time = ("", "/s", "/s2")[order]
    return ", ".join(unit + per_time for kind, unit in (("angle", "rad"), ("length", "m")) if kind in kinds)


def _tf_track(topics: _Topics, scene: Scene, stamps: NDArray[np.int64], metres: float) -> _Track:
    """Poses of all links [m, quaternion about z] where every one of them is known."""
    frames = ros2.frames(scene)
    template = Template().uint32(len(frames))
    for name in frames:
        template.stamp().string(ros2.ROOT).string(name).words(7)
    numbers = []
    for x, y, phi in (pose.T for pose in frames.values()):
        nothing = np.zeros(len(x))
        numbers += [metres * x, metres * y, nothing, nothing, nothing, np.sin(phi / 2), np.cos(phi / 2)]
    table = np.column_stack(numbers)
    rows = np.flatnonzero(np.isfinite(table).all(axis=1))
    channel = topics.add("/tf", "tf2_msgs/msg/TFMessage", ros2.TF_MESSAGE, {"units": "m"})
    return _Track(channel, rows, stamps[rows], template.fill(stamps[rows], table[rows]))


def _write_log(topics: _Topics, run: Run, zero: int) -> None:
    channel = topics.add("/log", "rcl_interfaces/msg/Log", ros2.LOG)
    for event in happenings(run):
        stamp = nanoseconds(np.array([max(event.t, float(zero))])) - zero * NANOSECONDS
        level = ros2.LOG_LEVELS.get(event.level, ros2.LOG_LEVELS["info"])
        template = Template().stamp().uint8(level).string("kinfmu").string(event.text).string("").string("").uint32(0)
        topics.write(channel, int(stamp[0]), template.fill(stamp)[0])


def _name(run: Run) -> str:
    return run.info.get("name") or "mechanism"
