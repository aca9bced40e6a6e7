"""Topics of a record: every sample, and those that ROS 2 viewers draw: joint states, transforms, description, log."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from kinfmu.draw.scene.scene import scene
from kinfmu.log import cdr, urdf
from kinfmu.log.cdr import NANOSECONDS, Messages, Template, nanoseconds
from kinfmu.log.mcap_writer import McapWriter
from kinfmu.log.record import is_integer, layout, tables
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.run import Event, Run
from kinfmu.units import METRES, CoordinateName

SOURCE = "kinfmu"  # of log messages that are events of the run
STATUS_SOURCE = "kinfmu.status"  # of log messages that follow from the samples
SAMPLE_TOPIC, LOG_TOPIC = "/sample", "/log"


class SampleTopic:
    """The full record, every sample, in the mechanism's own units."""

    def __init__(self, writer: McapWriter, run: Run) -> None:
        places = list(run.places())
        names = field_names(place.name for place in places)
        metadata = {f"unit.{name}": place.unit for name, place in zip(names, places, strict=True)}
        metadata |= {f"column.{name}": place.name for name, place in zip(names, places, strict=True)}
        fields = "\n".join(
            f"{'int64' if is_integer(place.table) else 'float64'} {name}  # {place.name} [{place.unit}]"
            for name, place in zip(names, places, strict=True)
        )
        definition = f"builtin_interfaces/Time stamp\n{fields}\n{cdr.TIME_DEFINITION}"
        self._writer, self._template, self._layout = writer, sample_template(len(places)), layout(run)
        self._channel = writer.channel(SAMPLE_TOPIC, "kinfmu_msgs/msg/Sample", definition, metadata)

    def add(self, run: Run, stamps: NDArray[np.int64]) -> None:
        """Write the next samples; stamps (n,) [ns]."""
        numbers = tables(run, self._layout)
        self._writer.write(self._channel, self._template.messages(np.arange(len(run)), stamps, numbers))


def sample_template(columns: int) -> Template:
    """Return the layout of /sample: a stamp, then the columns."""
    return Template().stamp().words(columns)


def field_names(columns: Iterable[str]) -> list[str]:
    """Return names that ROS 2 allows, 'coupler_x' for 'coupler.x': lower case, single underscores, all different."""
    names: dict[str, None] = {}
    for column in columns:
        name = re.sub(r"[^a-z0-9]+", "_", column.lower()).strip("_") or "column"
        name = name if name[0].isalpha() else f"n{name}"
        unused, number = name, 2
        while unused in names:
            unused, number = f"{name}_{number}", number + 1
        names[unused] = None
    return list(names)


class JointTopic:
    """Positions and speeds, or accelerations, of outputs; an empty message ends the curve where a gap begins."""

    def __init__(self, writer: McapWriter, run: Run, topic: str, columns: Sequence[int], orders: Sequence[int]) -> None:
        names = tuple(run.outputs[k] for k in columns)
        metres = METRES[run.length_unit]
        self._to_si = np.array([1.0 if name.is_angle else metres for name in names])
        self._columns = slice(None) if len(columns) == len(run.outputs) else list(columns)
        self._orders = orders
        self._writer = writer
        self._template, self._empty = _joint_state(names, len(orders) == 2), _joint_state((), False)
        self._was_good = False
        fields = zip(("position", "velocity"), orders, strict=False)
        units = "; ".join(f"{field}: {_si_units(names, order)}" for field, order in fields)
        self._channel = writer.channel(topic, "sensor_msgs/msg/JointState", cdr.JOINT_STATE, {"units": units})

    def add(self, run: Run, stamps: NDArray[np.int64]) -> None:
        """Write the next samples; stamps (n,) [ns]."""
        good = run.good
        rows = np.flatnonzero(good)
        gaps = np.flatnonzero(~good & np.append(self._was_good, good[:-1]))
        self._was_good = bool(good[-1])
        every = len(rows) == len(good)
        tables = [(run.values, run.rates, run.accelerations)[order][:, self._columns] for order in self._orders]
        numbers = [(table if every else table[rows]) * self._to_si for table in tables]
        self._writer.write(
            self._channel,
            self._template.messages(rows, stamps[rows], numbers),
            self._empty.messages(gaps, stamps[gaps]),
        )


class LinkTopic:
    """Poses of all links at samples where all of them are known, and once the robot description."""

    def __init__(self, writer: McapWriter, run: Run, mechanism: Mechanism) -> None:
        self._writer, self._mechanism = writer, mechanism
        self._metres = METRES[run.length_unit]
        self._name = run.info.get("name") or "mechanism"
        self._template: Template | None = None
        self._channel = -1

    def add(self, run: Run, stamps: NDArray[np.int64]) -> None:
        """Write the next samples; stamps (n,) [ns]."""
        if self._template is None:
            self._describe(run, stamps)
        if self._template is None:  # no link can be drawn
            return
        metres, numbers = self._metres, []
        for pose in urdf.link_poses(run, self._mechanism).values():
            x, y, phi = pose.T
            nothing = np.zeros_like(x)
            place = [metres * x, metres * y, nothing]
            numbers.append(np.column_stack([*place, nothing, nothing, np.sin(phi / 2), np.cos(phi / 2)]))
        with np.errstate(over="ignore", invalid="ignore"):  # a foreign record may hold any numbers
            rows = np.flatnonzero(run.good & np.isfinite(sum(table.sum(axis=1) for table in numbers)))
        if len(rows) < len(run):
            numbers = [table[rows] for table in numbers]
        self._writer.write(self._channel, self._template.messages(rows, stamps[rows], numbers))

    def _describe(self, run: Run, stamps: NDArray[np.int64]) -> None:
        """Write the robot description, drawn to the size of the mechanism in its first pose."""
        first = int(np.argmax(run.good))
        shown = scene(run.part(slice(first, first + 1)), self._mechanism)
        frames = urdf.link_poses(run.part(slice(0, 0)), self._mechanism)
        if not frames:
            return
        message = Template().string(urdf.robot_description(self._name, shown, self._metres))
        channel = self._writer.channel("/robot_description", "std_msgs/msg/String", cdr.STRING, {})
        self._writer.write(channel, message.messages(np.zeros(1, int), stamps[:1]))
        self._template = Template().uint32(len(frames))
        for name in frames:
            self._template.stamp().string(urdf.ROOT).string(name).words(7)
        self._channel = self._writer.channel("/tf", "tf2_msgs/msg/TFMessage", cdr.TF_MESSAGE, {"units": "m"})


class LogTopic:
    """The topic of events and changes of status."""

    def __init__(self, writer: McapWriter, zero: int) -> None:
        self._writer, self._zero = writer, zero
        self._channel = writer.channel(LOG_TOPIC, "rcl_interfaces/msg/Log", cdr.LOG, {})

    def add(self, entries: Sequence[tuple[str, Event]]) -> None:
        """Write events in order of time, each with its source."""
        repeated: dict[tuple[str, str, str], list[int]] = {}
        for place, (source, event) in enumerate(entries):
            repeated.setdefault((source, event.level, event.text), []).append(place)
        times = np.array([max(event.t, float(self._zero)) for _, event in entries])
        stamps = nanoseconds(times) - self._zero * NANOSECONDS
        messages = (_entries(*key, np.array(places), stamps) for key, places in repeated.items())
        self._writer.write(self._channel, *messages)


def _entries(source: str, level: str, text: str, places: NDArray[np.int64], stamps: NDArray[np.int64]) -> Messages:
    """Return log messages of the same source, level and text."""
    number = cdr.LOG_LEVELS.get(level, cdr.LOG_LEVELS["info"])
    template = Template().stamp().uint8(number).string(source).string(text).string("").string("").uint32(0)
    return template.messages(places, stamps[places])


def event_in(message: bytes, t: float) -> Event | None:
    """Return the event in a log message at time t [s]; None if the message follows from the samples."""
    level = next((name for name, number in cdr.LOG_LEVELS.items() if number == message[12]), "info")
    at, texts = 16, []  # a string: its length with the closing NUL, its bytes, and padding to a multiple of 4
    for _ in range(2):
        (count,) = struct.unpack_from("<I", message, at)
        texts.append(message[at + 4 : at + 3 + count].decode())
        at += 4 + count + -count % 4
    return Event(t, level, texts[1]) if texts[0] == SOURCE else None


def joint_topics(writer: McapWriter, run: Run) -> list[JointTopic]:
    """Return the topics /joint_states and /joint_accelerations of the columns that are kept."""
    kept = [[k for k, name in enumerate(run.outputs) if name.derivative(order) not in run.absent] for order in range(3)]
    topics = []
    if kept[0]:
        orders = (0, 1) if kept[0] == kept[1] else (0,)
        topics.append(JointTopic(writer, run, "/joint_states", kept[0], orders))
    if kept[2]:
        topics.append(JointTopic(writer, run, "/joint_accelerations", kept[2], (2,)))
    return topics


def _joint_state(names: tuple[str, ...], with_velocity: bool) -> Template:
    template = Template().stamp().string(urdf.ROOT).strings(names).sequence(len(names))
    return template.sequence(len(names) if with_velocity else 0).sequence(0)


def _si_units(names: tuple[CoordinateName, ...], order: int) -> str:
    kinds = {name.quantity().kind for name in names}
    per_time = ("", "/s", "/s2")[order]
    return ", ".join(unit + per_time for kind, unit in (("angle", "rad"), ("length", "m")) if kind in kinds)
