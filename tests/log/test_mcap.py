"""MCAP: the run reads back bit for bit, and other readers find what they can draw."""

from __future__ import annotations

import dataclasses
import struct
import subprocess
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

import kinfmu
from kinfmu.errors import LogError
from kinfmu.log import read, write_mcap
from kinfmu.log.mcap_writer import McapWriter
from kinfmu.log.topics import field_names
from kinfmu.log.viewer.headless import executable
from kinfmu.log.writing import FRAMES, MOST_DRAWN, PLAYED_SLOWLY, drawn_samples
from kinfmu.run import Event, Run
from kinfmu.run.channels import select
from tests.log.runs import fourbar, with_gap, without_samples


def messages(path: Path, topic: str) -> list[tuple[int, bytes]]:
    """Log time [ns] and payload of every message of a topic, in file order."""
    with path.open("rb") as file:
        found = make_reader(file, validate_crcs=True).iter_messages([topic], log_time_order=False)
        return [(message.log_time, message.data) for _, _, message in found]


def numbers_of_joint_state(payload: bytes) -> tuple[list[str], list[np.ndarray]]:
    """Names and the three arrays of a sensor_msgs/JointState, decoded by hand."""
    at = 4 + 8

    def align(size: int) -> None:
        nonlocal at
        at += -(at - 4) % size

    def count() -> int:
        nonlocal at
        align(4)
        (value,) = struct.unpack_from("<I", payload, at)
        at += 4
        return int(value)

    def string() -> str:
        nonlocal at
        length = count()
        at += length
        return payload[at - length : at - 1].decode()

    string()
    names = [string() for _ in range(count())]
    arrays = []
    for _ in range(3):
        length = count()
        if length:
            align(8)
        arrays.append(np.frombuffer(payload, "<f8", length, at))
        at += 8 * length
    assert at == len(payload)
    return names, arrays


def assert_same(a: Run, b: Run) -> None:
    """Check that runs are equal in every field, arrays in type, shape and bits; reactions hold the shaking force."""
    names = {field.name for field in dataclasses.fields(Run)}
    names = names - {"mechanism_source", "shaking"} | {"mechanism", "mechanism_text"}
    for name in names:
        x, y = getattr(a, name), getattr(b, name)
        if isinstance(x, np.ndarray):
            assert (x.dtype, x.shape) == (y.dtype, y.shape), name
            assert x.tobytes() == y.tobytes(), name
        else:
            assert x == y, name


def test_a_run_reads_back_bit_for_bit(any_run: Run, tmp_path: Path) -> None:
    write_mcap(any_run, tmp_path / "run.mcap")
    assert_same(any_run, read(tmp_path / "run.mcap"))


def test_a_run_without_samples_reads_back(run: Run, tmp_path: Path) -> None:
    empty = without_samples(run)
    write_mcap(empty, tmp_path / "run.mcap")
    assert_same(empty, read(tmp_path / "run.mcap"))


def test_a_run_over_no_driver_values_reads_back(tmp_path: Path) -> None:
    empty = kinfmu.solve(kinfmu.load("slider_crank"), crank_angle=[])
    write_mcap(empty, tmp_path / "run.mcap")
    back = read(tmp_path / "run.mcap")
    assert (len(back), back.axis, back.outputs) == (0, "crank_angle", empty.outputs)


def test_negative_zero_infinity_and_bits_of_nan_survive(run: Run, tmp_path: Path) -> None:
    values = run.values.copy()
    values[:4, 0] = [-0.0, np.inf, np.nextafter(0.0, 1.0), np.frombuffer(b"\x01\0\0\0\0\0\xf8\x7f")[0]]
    odd = dataclasses.replace(run, values=values, fixed=dict(zip(run.fixed, (-0.0, 0.1 + 0.2), strict=False)))
    write_mcap(odd, tmp_path / "run.mcap")
    assert_same(odd, read(tmp_path / "run.mcap"))
    assert np.signbit(read(tmp_path / "run.mcap").fixed["crank.x"])


def test_times_between_nanoseconds_survive(run: Run, tmp_path: Path) -> None:
    odd = dataclasses.replace(run, t=run.t + 1e-10 * np.pi, events=(Event(1 / 3, "info", "a third"),))
    write_mcap(odd, tmp_path / "run.mcap")
    assert_same(odd, read(tmp_path / "run.mcap"))


def test_the_same_run_gives_the_same_bytes(run: Run, tmp_path: Path) -> None:
    write_mcap(run, tmp_path / "a.mcap")
    write_mcap(run, tmp_path / "b.mcap")
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


@pytest.mark.parametrize(
    "channels",
    [["-drawn"], ["q", "qd", "drawn"], ["coupler.*", "drawn"], ["-qd", "-iterations", "-coupler.x"], ["none"]],
    ids=" ".join,
)
def test_a_part_of_a_run_reads_back_bit_for_bit(channels: list[str], run_with_gap: Run, tmp_path: Path) -> None:
    write_mcap(run_with_gap, tmp_path / "run.mcap", channels=channels, rate=0.5)
    part = select(run_with_gap, channels, 0.5)
    assert len(part) == 91
    assert_same(part, read(tmp_path / "run.mcap"))


def times_of(path: Path, topic: str) -> np.ndarray:
    """Log times [s] of a topic."""
    return np.array([time for time, _ in messages(path, topic)]) * 1e-9


def test_viewers_draw_evenly_spaced_samples_of_a_long_run(tmp_path: Path) -> None:
    n = 2 * MOST_DRAWN + 1
    run = with_gap(fourbar(np.linspace(0.0, 1800.0, n) / 10.0), 4712, 5400).replaced(t=np.linspace(0.0, 1800.0, n))
    write_mcap(run, tmp_path / "run.mcap")
    for topic in ("/tf", "/joint_states", "/joint_accelerations"):
        assert MOST_DRAWN / 2 < len(times_of(tmp_path / "run.mcap", topic)) <= MOST_DRAWN
    times = times_of(tmp_path / "run.mcap", "/tf")
    assert np.abs(times[:, None] - run.t[[0, 4711, 5401, n - 1]]).min(axis=0).max() < 1e-8  # ends, and those of the gap
    assert not np.any((times > run.t[4711] + 1e-8) & (times < run.t[5401] - 1e-8))
    apart = np.sort(np.diff(times))
    assert apart[-2] < 3.1 * 1800.0 / n  # without the gap
    assert_same(run, read(tmp_path / "run.mcap"))


def test_viewers_draw_as_many_samples_per_second_as_a_screen_shows_and_those_at_events(tmp_path: Path) -> None:
    run = fourbar(np.linspace(100.0, 150.0, 20_001))
    events = tuple(Event(float(run.t[k]), "warning", f"event {k}") for k in (77, 12_345))
    write_mcap(dataclasses.replace(run, events=events), tmp_path / "run.mcap")
    times = times_of(tmp_path / "run.mcap", "/tf")
    assert 50 * FRAMES < len(times) <= 50 * FRAMES + 4
    np.testing.assert_allclose(np.abs(times[:, None] - run.t[[0, 77, 12_345, 20_000]]).min(axis=0), 0.0, atol=1e-8)
    assert np.diff(times).max() < 1 / FRAMES + 50.0 / 20_000 + 1e-8
    assert len(messages(tmp_path / "run.mcap", "/sample")) == len(run)


def test_a_short_run_is_drawn_with_the_samples_that_a_plot_can_show() -> None:
    run = fourbar(np.linspace(10.0, 10.01, 20_001))
    assert len(drawn_samples(run)) == pytest.approx(PLAYED_SLOWLY * FRAMES, abs=3)
    run = fourbar(np.linspace(10.0, 10.01, 1001))
    assert len(drawn_samples(run)) == len(run)


def test_a_run_that_changes_its_status_at_every_sample_is_drawn_within_the_limit() -> None:
    run = fourbar(np.linspace(10.0, 170.0, 5 * MOST_DRAWN))
    run = run.replaced(status=np.arange(len(run)) % 2)
    rows = drawn_samples(run)
    assert MOST_DRAWN / 2 < len(rows) <= MOST_DRAWN
    assert (rows[0], rows[-1]) == (0, len(run) - 1)
    assert len(drawn_samples(without_samples(run))) == 0
    assert drawn_samples(run.part(slice(0, 1))).tolist() == [0]


def test_what_is_not_logged_is_not_in_the_file(run: Run, tmp_path: Path) -> None:
    write_mcap(run, tmp_path / "run.mcap", channels=["coupler.*", "drawn"])
    with (tmp_path / "run.mcap").open("rb") as file:
        channels = {one.topic: one for one in make_reader(file).get_summary().channels.values()}
    assert set(channels) == {"/sample", "/joint_states", "/joint_accelerations", "/robot_description", "/tf", "/log"}
    assert "column.crank_phi" not in channels["/sample"].metadata
    names, _ = numbers_of_joint_state(messages(tmp_path / "run.mcap", "/joint_states")[0][1])
    assert names == ["coupler.x", "coupler.y", "coupler.phi"]
    write_mcap(run, tmp_path / "record.mcap", channels=["-drawn"])
    with (tmp_path / "record.mcap").open("rb") as file:
        assert [one.topic for one in make_reader(file).get_summary().channels.values()] == ["/sample"]
    write_mcap(run, tmp_path / "state.mcap", channels=["q", "drawn"])
    _, (position, velocity, _) = numbers_of_joint_state(messages(tmp_path / "state.mcap", "/joint_states")[0][1])
    assert (len(position), len(velocity)) == (5, 0)


@pytest.mark.parametrize("channels", [None, ["-drawn"], ["-error", "-margin"], ["q", "qd"]])
def test_margins_and_errors_are_not_computed_for_a_record(channels: list[str] | None, run: Run, tmp_path: Path) -> None:
    def never() -> NoReturn:
        raise AssertionError("this was not to be computed")

    write_mcap(dataclasses.replace(run, margin=never, error=never), tmp_path / "run.mcap", channels=channels)
    back = read(tmp_path / "run.mcap")
    assert back.absent == select(run, channels).absent
    with (tmp_path / "run.mcap").open("rb") as file:
        sample = next(one for one in make_reader(file).get_summary().channels.values() if one.topic == "/sample")
    assert {name for name in sample.metadata if "margin" in name or "error" in name} == set()


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.parametrize("driven", [{}, {"crank_angle": np.linspace(0.5, 6.5, 90), "crank_speed": 2.0}])
@pytest.mark.few(1)
def test_margins_and_errors_of_a_record_are_those_of_its_run(
    driven: dict[str, np.ndarray], engine: str, tmp_path: Path
) -> None:
    run = kinfmu.solve(kinfmu.load("crank_rocker"), engine=engine, **driven)
    write_mcap(run, tmp_path / "run.mcap")
    back = read(tmp_path / "run.mcap")
    assert run.is_lazy("error")
    assert back.is_lazy("error")
    np.testing.assert_allclose(back.margin, run.margin, rtol=1e-9)
    np.testing.assert_allclose(back.error, run.error, rtol=0.0 if engine == "python" else 0.9)
    write_mcap(run, tmp_path / "run.mcap")  # they have been read
    assert not read(tmp_path / "run.mcap").is_lazy("error")
    assert_same(run, read(tmp_path / "run.mcap"))


def test_an_error_of_a_record_is_at_least_what_its_numbers_are_off(tmp_path: Path) -> None:
    run = kinfmu.solve(kinfmu.load("crank_rocker"))
    values, rates, accelerations = (table.copy() for table in (run.values, run.rates, run.accelerations))
    values[3, 0] += 1e-9
    values[4, 0] += 0.1  # another pose
    rates[5, 0] += 1e-6
    accelerations[6, 0] -= 1e-3
    write_mcap(run.replaced(values=values, rates=rates, accelerations=accelerations), tmp_path / "run.mcap")
    back = read(tmp_path / "run.mcap")
    off = [back.error[3, 0], back.error[4, 0], back.error[5, 1], back.error[6, 2]]
    np.testing.assert_allclose(off, [1e-9, 0.1, 1e-6, 1e-3], rtol=1e-5)
    assert np.flatnonzero(np.isnan(back.margin)).tolist() == [4]
    rows = np.r_[0:3, 7 : len(run)]
    assert np.array_equal(back.error[rows], run.error[rows])


def test_rerun_verifies_the_file(any_run: Run, tmp_path: Path) -> None:
    write_mcap(any_run, tmp_path / "run.mcap")
    process = subprocess.run(
        [executable(), "mcap", "check", "--full", str(tmp_path / "run.mcap")],
        capture_output=True,
        text=True,
        check=False,
    )
    assert process.returncode == 0, process.stdout + process.stderr
    rows = [line.split() for line in process.stdout.splitlines() if "/" in line and "ID" not in line]
    assert {row[0] for row in rows[1:]} == {"ok"}


def test_log_times_are_rounded_to_whole_nanoseconds(tmp_path: Path) -> None:
    write_mcap(fourbar(np.arange(3000) * 1e-3), tmp_path / "run.mcap")
    times = [time for time, _ in messages(tmp_path / "run.mcap", "/sample")]
    assert times == [k * 1_000_000 for k in range(3000)]


def test_a_run_from_before_zero_is_counted_from_a_whole_second(tmp_path: Path) -> None:
    write_mcap(fourbar(np.array([-0.5, 0.0, 0.5])), tmp_path / "run.mcap")
    assert [time for time, _ in messages(tmp_path / "run.mcap", "/sample")] == [500_000_000, 10**9, 1_500_000_000]
    with (tmp_path / "run.mcap").open("rb") as file:
        metadata = {one.name: one.metadata for one in make_reader(file).iter_metadata()}
    assert metadata["kinfmu.about"]["time_zero_s"] == "-1"


def test_joint_states_hold_the_coordinates_and_their_rates(run: Run, tmp_path: Path) -> None:
    write_mcap(run, tmp_path / "run.mcap")
    found = messages(tmp_path / "run.mcap", "/joint_states")
    assert len(found) == len(run)
    names, (position, velocity, effort) = numbers_of_joint_state(found[60][1])
    assert names == list(run.outputs)
    np.testing.assert_array_equal(position, run.values[60])
    np.testing.assert_array_equal(velocity, run.rates[60])
    assert not len(effort)
    _, (acceleration, *rest) = numbers_of_joint_state(messages(tmp_path / "run.mcap", "/joint_accelerations")[60][1])
    np.testing.assert_array_equal(acceleration, run.accelerations[60])
    assert [len(array) for array in rest] == [0, 0]


def test_a_gap_is_one_empty_message_and_no_numbers(run_with_gap: Run, tmp_path: Path) -> None:
    write_mcap(run_with_gap, tmp_path / "run.mcap")
    found = messages(tmp_path / "run.mcap", "/joint_states")
    empty = [time for time, payload in found if not len(numbers_of_joint_state(payload)[1][0])]
    assert empty == [100 * 10**9]
    assert {time for time, _ in found} == {k * 10**9 for k in range(181) if not 100 < k <= 120}
    assert all(np.isfinite(numbers_of_joint_state(payload)[1][0]).all() for _, payload in found)
    assert len(messages(tmp_path / "run.mcap", "/tf")) == 160
    assert len(messages(tmp_path / "run.mcap", "/sample")) == 181


def test_drawn_lengths_are_metres_and_the_record_keeps_the_unit(run: Run, tmp_path: Path) -> None:
    text = run.mechanism_text.replace('length = "m"', 'length = "mm"')
    write_mcap(dataclasses.replace(run, length_unit="mm", mechanism_source=text), tmp_path / "run.mcap")
    _, (position, *_) = numbers_of_joint_state(messages(tmp_path / "run.mcap", "/joint_states")[60][1])
    np.testing.assert_allclose(position, run.values[60] * np.where([n.endswith("phi") for n in run.outputs], 1, 1e-3))
    with (tmp_path / "run.mcap").open("rb") as file:
        channels = {one.topic: one.metadata for one in make_reader(file).get_summary().channels.values()}
    assert channels["/sample"]["unit.coupler_vx"] == "mm/s"
    assert channels["/joint_states"]["units"] == "position: rad, m; velocity: rad/s, m/s"
    assert read(tmp_path / "run.mcap")["coupler.x"][60] == run["coupler.x"][60]


def test_status_and_events_are_in_the_log(run_with_gap: Run, tmp_path: Path) -> None:
    write_mcap(run_with_gap, tmp_path / "run.mcap")
    found = [(time // 10**9, payload[12]) for time, payload in messages(tmp_path / "run.mcap", "/log")]
    assert found == [(0, 20), (1, 20), (100, 40), (121, 20), (180, 20)]
    assert any(b"the limit is 1.75 rad" in payload for _, payload in messages(tmp_path / "run.mcap", "/log"))


def test_the_mechanism_file_is_attached(run: Run, tmp_path: Path) -> None:
    write_mcap(run, tmp_path / "run.mcap")
    with (tmp_path / "run.mcap").open("rb") as file:
        attachments = list(make_reader(file).iter_attachments())
    assert [one.name for one in attachments] == ["mechanism.toml"]
    assert attachments[0].data.decode() == run.mechanism_text


def test_every_column_has_a_field_of_its_own() -> None:
    names = field_names(["A.x", "a.x", "watch.Bar 1 - length", "_b.phi", "2", "é"])
    assert names == ["a_x", "a_x_2", "watch_bar_1_length", "b_phi", "n2", "column"]


def test_a_time_that_is_not_a_number_is_refused_and_the_old_file_stays(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(b"old")
    with pytest.raises(LogError, match=r"time of sample 3 is nan s; a log needs a number within \+-2147483647 s"):
        write_mcap(dataclasses.replace(run, t=np.where(run.t == 3.0, np.nan, run.t)), path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_failure_while_writing_leaves_the_old_file(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_space(*_: object) -> None:
        raise OSError(28, "No space left on device")

    path = tmp_path / "run.mcap"
    path.write_bytes(b"old")
    monkeypatch.setattr(McapWriter, "finish", no_space)
    with pytest.raises(LogError, match=r"run\.mcap: cannot be written \(No space left on device\)"):
        write_mcap(run, path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_in_the_place_of_the_file_and_a_file_in_that_of_a_folder_are_named(run: Run, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(LogError, match=r"run\.mcap: cannot be written \(Not a directory\)$"):
        write_mcap(run, tmp_path / "file" / "run.mcap")
    with pytest.raises(LogError, match=r"is a folder; the name of a file is needed$"):
        write_mcap(run, tmp_path)


def test_a_symbolic_link_is_kept(run: Run, tmp_path: Path) -> None:
    (tmp_path / "link.mcap").symlink_to(tmp_path / "run.mcap")
    write_mcap(run, tmp_path / "link.mcap")
    assert (tmp_path / "link.mcap").is_symlink()
    assert_same(run, read(tmp_path / "run.mcap"))


@pytest.mark.parametrize("kept", [0, 5, 3000, -20])
def test_a_truncated_file_is_reported_in_one_line(run: Run, tmp_path: Path, kept: int) -> None:
    path = tmp_path / "run.mcap"
    write_mcap(run, path)
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(LogError, match=r"run\.mcap: not a whole MCAP file: ") as caught:
        read(path)
    assert "\n" not in str(caught.value)


def test_a_damaged_file_is_reported_or_reads_back_as_it_was(run_with_gap: Run, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    write_mcap(run_with_gap, path)
    whole, random = path.read_bytes(), np.random.default_rng(1)
    messages_found: list[str] = []
    for place in random.integers(len(whole), size=150):
        damaged = bytearray(whole)
        damaged[place] ^= int(random.integers(1, 256))
        path.write_bytes(damaged)
        try:
            assert_same(run_with_gap, read(path))
        except LogError as error:
            messages_found.append(str(error))
    assert len(messages_found) > 30
    assert all(text.startswith(f"{path}: ") and "\n" not in text for text in messages_found)


def test_a_file_of_another_program_is_not_taken_for_a_run(tmp_path: Path) -> None:
    path = tmp_path / "other.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/camera", "json", writer.register_schema("s", "jsonschema", b"{}"))
        writer.add_message(channel, 0, b"{}", 0)
        writer.finish()
    with pytest.raises(LogError, match=r"no topic /sample, so this is not a run of kinfmu; topics: /camera"):
        read(path)
    (tmp_path / "text.mcap").write_text("t,x\n0,1\n" * 20)
    with pytest.raises(LogError, match="not a whole MCAP file"):
        read(tmp_path / "text.mcap")
    with pytest.raises(LogError, match=r"nothing\.mcap: cannot be read \(No such file or directory\)"):
        read(tmp_path / "nothing.mcap")


def test_a_gap_of_several_pieces_has_an_empty_message_each(run: Run, tmp_path: Path) -> None:
    write_mcap(with_gap(with_gap(run, 10, 12), 20, 20), tmp_path / "run.mcap")
    found = messages(tmp_path / "run.mcap", "/joint_states")
    assert [time // 10**9 for time, payload in found if not numbers_of_joint_state(payload)[0]] == [10, 20]


@pytest.mark.parametrize("compression", [CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD])
def test_a_file_rewritten_by_another_program_reads_back(
    compression: CompressionType, run_with_gap: Run, tmp_path: Path
) -> None:
    write_mcap(run_with_gap, tmp_path / "run.mcap")
    with (tmp_path / "run.mcap").open("rb") as source, (tmp_path / "anew.mcap").open("wb") as target:
        reader, writer = make_reader(source), Writer(target, chunk_size=10_000, compression=compression)
        writer.start()
        channels: dict[int, int] = {}
        for schema, channel, message in reader.iter_messages():  # by time, all topics in the same chunks
            if channel.id not in channels:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                metadata, encoding = channel.metadata, channel.message_encoding
                channels[channel.id] = writer.register_channel(channel.topic, encoding, number, metadata)
            place = channels[channel.id]
            writer.add_message(place, message.log_time, message.data, message.publish_time, message.sequence)
        for record in reader.iter_metadata():
            writer.add_metadata(record.name, record.metadata)
        for one in reader.iter_attachments():
            writer.add_attachment(one.create_time, one.log_time, one.name, one.media_type, one.data)
        writer.finish()
    assert_same(run_with_gap, read(tmp_path / "anew.mcap"))
