"""Forces in records: they read back to the same bits, and what is not kept is not computed."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.errors import LogError, RequestError
from kinfmu.log import McapLog, read, recover, write_mcap, write_table
from kinfmu.log.record import description, lists_in
from kinfmu.run import Run
from kinfmu.run.channels import select
from tests.run.test_forces import loaded

EFFORTS = ("crank.torque", "crank.power", "crank.bias_torque", "crank.reduced_inertia")


@pytest.fixture(scope="module")
def run() -> Run:
    return kinfmu.solve(loaded("fourbar"), np.arange(40.0) + 10.0)


def bits(run: Run) -> list[tuple[str, str, bytes]]:
    return [(column.name, column.unit, column.values.tobytes()) for column in run.columns()]


def test_forces_read_back_to_the_same_bits_with_names_and_units(run: Run, tmp_path: Path) -> None:
    write_mcap(run, tmp_path / "run.mcap")
    again = read(tmp_path / "run.mcap")
    assert bits(again) == bits(run)
    assert again.force_names == (*EFFORTS, "kinetic_energy", "potential_energy")
    assert {"O.force_x", "AB.force"} <= set(again.reaction_names)
    for names, found in ((run.force_names, again.force_names), (run.reaction_names, again.reaction_names)):
        assert [(name.owner, name.noun, name.quantity) for name in names] == [
            (name.owner, name.noun, name.quantity) for name in found
        ]


def test_two_drivers_share_a_reduced_inertia_whose_name_reads_back(tmp_path: Path) -> None:
    run = kinfmu.solve(loaded("five_bar"), np.linspace(0.0, 0.2, 5))
    write_mcap(run, tmp_path / "run.mcap")
    (name,) = [name for name in read(tmp_path / "run.mcap").force_names if name.count(".") == 2]
    assert (name.owner, name.noun) == (run.input_names[0].driver, f"reduced_inertia.{run.input_names[3].driver}")


def test_a_growing_record_that_was_cut_off_keeps_its_forces(run: Run, tmp_path: Path) -> None:
    log = McapLog(tmp_path / "cut.mcap")
    log.begin(run.part(slice(0, 0)))
    for start in range(0, 40, 10):
        log.add(run.part(slice(start, start + 10)))
    log.close()
    left = recover(tmp_path / "cut.mcap", tmp_path / "whole.mcap")
    assert bits(left) == bits(read(tmp_path / "whole.mcap")) == bits(run)


@pytest.mark.parametrize("channels", [["forces"], ["-reactions"], ["crank.torque"], ["reactions", "-AB.*"]])
def test_channels_choose_forces_and_reactions(run: Run, channels: list[str], tmp_path: Path) -> None:
    write_mcap(run, tmp_path / "run.mcap", channels=channels)
    again = read(tmp_path / "run.mcap")
    assert bits(again) == bits(select(run, channels))
    kept = {place.name for place in again.places() if place.table in ("forces", "reactions")}
    expected = {
        "forces": set(run.force_names),
        "-reactions": set(run.force_names),
        "crank.torque": {"crank.torque"},
        "reactions": {name for name in run.reaction_names if name.owner != "AB"},
    }[channels[0]]
    assert kept == expected
    assert np.isnan(np.asarray(again.reactions)[:, [name not in kept for name in run.reaction_names]]).all()


def test_forces_that_are_not_kept_are_not_computed(tmp_path: Path) -> None:
    def fail() -> np.ndarray:
        raise AssertionError("computed")

    run = kinfmu.solve(loaded("fourbar"), np.arange(5.0)).replaced(forces=fail, reactions=fail)
    write_mcap(run, tmp_path / "run.mcap", channels=["-forces", "-reactions"])
    assert np.isnan(np.asarray(read(tmp_path / "run.mcap").forces)).all()
    run.without(["crank.torque"]).part(slice(0, 2))
    with pytest.raises(AssertionError, match="computed"):
        write_mcap(run, tmp_path / "run.mcap")


def test_an_unknown_force_is_named_with_the_nearest(run: Run) -> None:
    with pytest.raises(RequestError, match=r"channel 'crank.torqe' is not known; did you mean 'crank.torque'\?"):
        select(run, ["crank.torqe"])


def test_tables_hold_forces_with_their_units(run: Run, tmp_path: Path) -> None:
    write_table(run, tmp_path / "run.npz")
    write_table(run, tmp_path / "run.csv", ["forces"])
    with np.load(tmp_path / "run.npz") as table:
        units = dict(zip(table["kinfmu.columns"].tolist(), table["kinfmu.units"].tolist(), strict=True))
        np.testing.assert_array_equal(table["O.force_x"], run["O.force_x"])
    assert [units[name] for name in (*EFFORTS, "O.force_x")] == ["N m", "W", "N m", "kg m2", "N"]
    header = (tmp_path / "run.csv").read_text(encoding="utf-8").splitlines()[0].split(",")
    assert header == ["time", *run.force_names, "solver.status"]
    assert run.to_arrow().schema.field("kinetic_energy").metadata[b"unit"] == b"J"


def test_copies_and_parts_keep_forces(run: Run) -> None:
    for other in (pickle.loads(pickle.dumps(run)), copy.deepcopy(run)):  # noqa: S301  our own bytes
        assert bits(other) == bits(run)
        assert other.force_names[0].quantity == run.force_names[0].quantity
    np.testing.assert_array_equal(run.part(slice(3, 9))["crank.torque"], run["crank.torque"][3:9])


def test_records_without_masses_say_nothing_of_forces(tmp_path: Path) -> None:
    run = kinfmu.solve(kinfmu.load("fourbar"), np.arange(3.0))
    assert not {"forces", "reactions"} & set(description(run))
    write_mcap(run, tmp_path / "run.mcap")
    again = read(tmp_path / "run.mcap")
    assert (again.forces, again.reactions, again.force_names, again.reaction_names) == (None, None, (), ())


@pytest.mark.parametrize("text", ['["crank.torque"]', '{"crank.torque": "love"}', '{".torque": "torque"}', "3"])
def test_invalid_forces_of_a_record_get_one_line(run: Run, text: str) -> None:
    with pytest.raises(LogError, match=r"forces of the record = .* must be kinds of quantities, such as 'torque'"):
        lists_in(description(run) | {"forces": text})
