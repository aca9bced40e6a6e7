"""Study files: what they say is what is measured, and each mistake has one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import kinfmu
from kinfmu.cli import main
from kinfmu.design.study import read_study
from kinfmu.design.study.sampling import Grid, Tolerance, UniformRange
from kinfmu.errors import KinfmuError, RequestError, StudyError
from tests.design.study.linkage import linkage, write

CRANK = 'mechanism = "hoeken.toml"\n[parameters]\ncrank = { from = 15, to = 25 }\n'
WRONG = {
    "[bodies.crank]": "this is a mechanism file; a study file names it, such as mechanism = 'fourbar.toml'; keys: mech",
    'mechanism = "hoeken.toml"\n[unknowns]': "this is a fit file, not a study file; the command is 'kinfmu fit'",
    'mechanism = "hoeken.toml"\nparameters.crank = { tol = 1 }': "tol: unknown key; did you mean 'tolerance'",
    "designs = 4": "mechanism is missing: a mechanism file, such as mechanism = 'fourbar.toml', or a gallery name",
    'mechanism = "hoken.toml"': "cannot be read (No such file or directory)",
    'mechanism = "fourbr"\nparameters.a = { from = 1, to = 2 }': "'fourbr' is not in the gallery; did you mean '",
    'mechanism = "hoeken.toml"': "a study needs [parameters]: which of them vary, and how",
    'mechanism = "hoeken.toml"\nparameters.crnk = { from = 1, to = 2 }': (
        "there is no parameter 'crnk'; did you mean 'crank'?; parameters: crank, rocker, base, crank.start, crank.speed"
    ),
    'mechanism = "hoeken.toml"\nparameters.crank = 3': "[parameters.crank] = 3 must be a table such as { from = 1, to",
    "sampling.x = 1": "mechanism is missing",
    'mechanism = "hoeken.toml"\nsample = 3': "sample: unknown key; did you mean 'samp",
    f'sampling = "sobl"\n{CRANK}': "sampling = 'sobl' is not known; did you mean 'sobol'?; known: sobol,",
    f"designs = 0\n{CRANK}": "designs = 0 must be a whole number from 1 to 1000000000",
    f"designs = 2.5\n{CRANK}": "designs = 2.5 must be a whole number",
    f"seed = -1\n{CRANK}": "seed = -1 must be a whole number from 0",
    f'report = ["swng"]\n{CRANK}': "there is no measure 'swng'; did you mean 'swing'?; measures: swing, fastest",
    f"report = 3\n{CRANK}": "report = 3 must be a list of names of measures",
    f"report = []\n{CRANK}": "report = [] must be a list of names of measures",
    f"{CRANK}[measures.more]\ntype = 'rang'": "[measures.more] type = 'rang' is not known; did you mean 'range'?",
    f"{CRANK}[measures.more]\ntype = 'range'\nof = 'rockr.phi'": "[measures.more] of: 'rockr.phi' is not a coordinate",
    f"{CRANK}[measures.crank]\ntype = 'range'\nof = 'rocker.phi'": (
        "the measure 'crank' has the name of another column of the results; rename it"
    ),
    f"{CRANK}[run]\nstart = 0\nfrom = 1": "[run] has 'start', a time, and 'from', of a driver's values",
    f"{CRANK}[run]\nfrom = 1": "[run] needs the key 'to'",
    f"{CRANK}[run]\nfrom = '1 mm'\nto = 2": "[run] from = '1 mm': unit 'mm' must be one of rad, deg, rev",
    f"{CRANK}[run]\nstop = 1\nstep = 0": "[run] must have a positive step, and stop after start",
    f"{CRANK}[run]\nfrom = 1\nto = 2\nsamples = 1": "[run] samples = 1 must be a whole number from 3 to 1",
    f"{CRANK}[run]\nstop = 0\nstep = 1": "t = 0 to 0 s: measures need 3 samples or more, not 1",
    f"{CRANK}[run]\nstop = 1\nstep = 1": "t = 0 to 1 s: measures need 3 samples or more, not 2",
    f"{CRANK}[run]\nfrom = 1\nto = 2\nspeed = '0 rpm'": "[run] speed = '0 rpm': measures need a driver that moves",
    f"{CRANK}[run]\nfrom = 1\nto = 1": "[run]: 'from' and 'to' are equal: 1; measures need a driver that moves",
    f"{CRANK}[run]\nstop = 1\nstep = '1e-12 s'": "[run] 0 to 1 s in steps of 1e-12 s: more than 10000000 samples",
    f"designs = 1000000000\nsampling = 'latin_hypercube'\n{CRANK}": (
        "designs = 1000000000: a Latin hypercube is drawn as a whole and has at most 50000000 designs here; "
        "Sobol points (sampling = 'sobol') are drawn part by part"
    ),
    f"{CRANK}base = {{ from = 1, to = 2, count = 100000 }}\nrocker = {{ from = 1, to = 2, count = 100000 }}\n"
    '"crank.start" = { from = 1, to = 2, count = 100000 }\n"crank.speed" = { from = 1, to = 2, count = 100000 }': (
        "the number of designs, of all grids and samples together, = 100000000000000000000000 must be a whole number"
    ),
    f"{CRANK}[run]\nend = 1": "[run] end: unknown key",
    'mechanism = "hoeken.toml"\n[parameters]\n"crank.speed" = { values = [1, 2] }\n[run]\nfrom = 1\nto = 2': (
        "crank.speed changes a driver's law, which acts over time: give times ([run] start, stop and step in a study "
        "file) in place of driver values, or neither"
    ),
}
WRONG_PARAMETERS = {
    "count = 3": "needs 'values', 'from' or 'tolerance'; give one of { from = 1, to = 2, count = 5 }",
    "from = 1, tolerance = 2": "has from and tolerance, which exclude each other",
    "form = 1, to = 2": "form: unknown key; did you mean 'from'?",
    "from = 1": "needs the key 'to'",
    "from = 1, to = 1": "'from' and 'to' are equal: 1",
    "from = 1, to = 2, count = 1": "count = 1 must be a whole number from 2",
    "from = 1, to = 2, count = 1000000000": "count = 1000000000 must be a whole number from 2 to 1000000",
    "from = 1, to = 2, distribution = 'normal'": "distribution: does not go with 'from'; keys with it: count, from, to",
    "from = '1 deg', to = 2": "from = '1 deg': unit 'deg' must be one of m, mm",
    "from = 'a', to = 2": "from = 'a' must be a number, alone or with a unit",
    "values = []": "values = [] must be a list of numbers",
    "values = 3": "values = 3 must be a list of numbers",
    "tolerance = 0": "tolerance = 0 must be more than 0",
    "tolerance = '1 s'": "tolerance = '1 s': unit 's' must be one of m, mm",
    "tolerance = 1, distribution = 'gauss'": "distribution = 'gauss' is not known; known: normal, uniform",
    "tolerance = 1, deviations = 0": "deviations = 0 must be a positive number",
    "tolerance = 1, deviations = 2, distribution = 'uniform'": "deviations: only a normal distribution has them",
}


@pytest.mark.parametrize("text", WRONG)
def test_a_mistake_is_named_with_its_place(text: str, tmp_path: Path) -> None:
    path = write(tmp_path, text)
    with pytest.raises(StudyError) as error:
        read_study(path)
    assert str(error.value).startswith(f"{path}: ")
    assert WRONG[text] in str(error.value)
    done = CliRunner().invoke(main, ["study", str(path)])
    assert (done.exit_code, done.output) == (1, f"kinfmu: {error.value}\n")
    assert not list(tmp_path.glob("*.parts"))


@pytest.mark.parametrize("table", WRONG_PARAMETERS)
def test_so_is_one_in_a_parameter(table: str, tmp_path: Path) -> None:
    path = write(tmp_path, f'mechanism = "hoeken.toml"\nparameters.crank = {{ {table} }}')
    with pytest.raises(StudyError) as error:
        read_study(path)
    assert str(error.value).startswith(f"{path}: [parameters.crank]")
    assert WRONG_PARAMETERS[table] in str(error.value)


@pytest.mark.parametrize("content", [b"a = ", b"\xff"])
def test_files_that_are_no_study_are_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_bytes(content)
    with pytest.raises(StudyError, match=r"study\.toml: not"):
        read_study(path)
    with pytest.raises(StudyError, match=r"no\.toml: cannot be read"):
        read_study(tmp_path / "no.toml")


def test_the_mechanism_is_found_from_the_folder_of_the_file_or_in_the_gallery(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    path = write(folder, 'mechanism = "hoeken.toml"\ndesigns = 3\nparameters.crank = { from = "1.5 cm", to = 25 }')
    monkeypatch.chdir(tmp_path)
    study = read_study(path)
    assert study.sampling.variations == (UniformRange("crank", "mm", 15.0, 25.0),)
    assert len(study) == 3
    assert (study.motion.over, len(study.motion)) == ("one turn of crank at 30 rpm", 361)
    measures = "[measures.stride]\ntype = 'range'\nof = 'foot.x'"
    path = write(folder, f'mechanism = "jansen_leg"\n[parameters]\na = {{ tolerance = 0.01 }}\n{measures}')
    (tolerance,) = read_study(path).sampling.tolerances
    assert (tolerance.nominal, tolerance.deviations) == (kinfmu.load("jansen_leg").parameters["a"].value, 3.0)


def test_variations_and_motions_are_read_with_their_units(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        """
        mechanism = "hoeken.toml"
        [parameters]
        crank = { from = "2 cm", to = 22, count = 3 }
        base = { tolerance = "0.1 mm", deviations = 2, nominal = 41 }
        rocker = { tolerance = "100 um", distribution = "uniform" }
        [run]
        from = "0 deg"
        to = "90 deg"
        samples = 10
        speed = "60 rpm"
        """,
    )
    study = read_study(path)
    grid, normal, uniform = study.sampling.variations
    assert grid == Grid("crank", "mm", (20.0, 21.0, 22.0))
    assert isinstance(normal, Tolerance)
    assert isinstance(uniform, Tolerance)
    assert (normal.nominal, normal.deviation) == (41.0, pytest.approx(0.05))
    assert (uniform.nominal, uniform.deviation) == (50.0, pytest.approx(0.1 / np.sqrt(3.0)))
    assert np.allclose(study.motion.inputs["crank_angle"], np.linspace(0.0, np.pi / 2.0, 10))
    assert study.motion.inputs["crank_speed"] == pytest.approx(2.0 * np.pi)
    assert len(study) == 3000
    times = read_study(write(tmp_path, f"{CRANK}[run]\nstop = '20 ms'\nstep = '5 ms'")).motion.t
    assert times is not None
    assert np.allclose(times, [0.0, 0.005, 0.01, 0.015, 0.02])


def test_arguments_of_a_call_are_refused_likewise() -> None:
    ranges = {"crank": {"from": 15, "to": 25}}
    with pytest.raises(RequestError, match="designs = 0 must be a whole number"):
        kinfmu.study(linkage(), ranges, designs=0)
    with pytest.raises(RequestError, match="workers = 0 must be a positive whole number"):
        kinfmu.study(linkage(), ranges, workers=0)
    with pytest.raises(RequestError, match=r"rows\.npz: the name of the results must end in \.parquet, \.csv"):
        kinfmu.study(linkage(), ranges, output="rows.npz")
    with pytest.raises(RequestError, match="give times or inputs, not both: t and crank_angle"):
        kinfmu.study(linkage(), ranges, t=[0.0, 1.0], crank_angle=[0.0, 1.0])
    with pytest.raises(RequestError, match="engine 'fast' is not known"):
        kinfmu.study(linkage(), ranges, engine="fast")
    with pytest.raises(RequestError, match=r"crank_angle must be a number or \(n,\)"):
        kinfmu.study(linkage(), ranges, crank_angle=[[0.0, 1.0]])
    with pytest.raises(KinfmuError, match="crank_agle"):
        kinfmu.study(linkage(), ranges, designs=2, workers=1, crank_agle=[0.0, 1.0, 2.0])


@pytest.mark.parametrize(
    ("parameters", "arguments", "message"),
    [
        ({5: {"values": [20]}}, {}, "[parameters.5]: parameters have names, not 5"),
        ({"crank": {"values": [20]}}, {"t": "x"}, "t must be a number or an array of numbers"),
        ({"crank": {"values": [20]}}, {"t": True}, "t must be a number or an array of numbers, not true or false"),
        ({"crank": {"values": [20, True]}}, {}, "[parameters.crank] values = true must be a number"),
        ({"crank": {"values": [20]}}, {"t": []}, "t must be a number or (n,), not of shape (0,)"),
        ({"crank": {"values": [20]}}, {"t": [[1, 2]]}, "t must be a number or (n,), not of shape (1, 2)"),
        ({"crank": {"values": [20]}}, {"crank_angle": []}, "crank_angle must be a number or (n,), not of shape (0,)"),
        (
            {"crank": {"values": [20]}},
            {"measures": 5},
            "measures = 5 must be a list of measures or of names of measures",
        ),
        (
            {"crank": {"values": [20]}},
            {"measures": [5]},
            "measures: 5 is neither a measure such as kinfmu.meas",
        ),
        ({"crank": {"values": [20]}}, {"output": 5}, "output = 5 must be the path of a file, .parquet, .csv"),
    ],
)
def test_so_is_one_in_a_call(parameters: dict[Any, Any], arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(RequestError) as error:
        kinfmu.study(linkage(), parameters, workers=1, **arguments)
    assert str(error.value).startswith(message)


def test_a_bare_number_is_noted_where_the_mechanism_file_writes_another_unit(tmp_path: Path) -> None:
    path = write(tmp_path, CRANK)
    assert read_study(path).notes == ()
    file = tmp_path / "hoeken.toml"
    file.write_text(file.read_text("utf-8").replace('"20 mm"', '"2 cm"'), "utf-8")
    assert read_study(path).notes == (
        "[parameters] crank = 15 is taken in mm; the mechanism file writes it in cm: for these write '15 cm'",
    )
    path.write_text(CRANK.replace("15", "'1.5 cm'").replace("25", "'2.5 cm'"), "utf-8")
    assert read_study(path).notes == ()
