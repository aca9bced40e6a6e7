"""kinfmu export to a page: the parameters and the time of a run, and pages of mechanisms."""

from __future__ import annotations

import base64
import gzip
import json
import re
import zipfile
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu.errors import RequestError
from kinfmu.log import write_mcap
from tests.cli.conftest import Command, command, fails, program_called, refuses
from tests.page.engines import CHROMIUM, browser

BUILD = import_module("kinfmu.cli.build")
PAGE = BUILD._page  # before the tests begin, which build without pages
DATA = re.compile(r'id="data">([^<]*)<')
__all__ = ["command", "fails", "program_called", "refuses"]  # fixtures


def data_of(page: Path) -> dict[str, Any]:
    text = page.read_text("utf-8")
    found: dict[str, Any] = json.loads(gzip.decompress(base64.b64decode(DATA.findall(text)[0])))
    return found


def test_the_page_of_a_run_has_its_parameters_and_its_time(command: Command, tmp_path: Path) -> None:
    mech = kinfmu.load("crank_rocker").with_parameters({"crank.speed": "45 rpm"})
    write_mcap(kinfmu.solve(mech, np.linspace(0.25, 1.25, 11)), tmp_path / "run.mcap")
    assert command("export", "run.mcap", "-o", "run.html").stdout == "written: run.html\n"
    data = data_of(tmp_path / "run.html")
    assert data["run"] == {"from": 0.25, "to": 1.25, "step": 0.005}
    speeds = [one["value"] for one in data["modules"]["written"]["parameters"] if one["name"] == "crank.speed"]
    assert speeds == pytest.approx([1.5 * np.pi])
    assert command("export", "run.mcap", "-o", "part.html", "--stop", "1").exit_code == 0
    assert data_of(tmp_path / "part.html")["run"]["to"] == pytest.approx(0.95)


@pytest.mark.long
def test_the_page_of_a_run_over_an_angle_has_the_axis_of_the_driver(tmp_path: Path, command: Command) -> None:
    run = kinfmu.solve(kinfmu.load("crank_rocker"), crank_angle=np.radians(np.linspace(30.0, 120.0, 19)))
    write_mcap(run, tmp_path / "run.mcap")
    assert command("export", "run.mcap", "-o", "run.html").exit_code == 0
    assert data_of(tmp_path / "run.html")["over"] == {"driver": 0, "from": np.radians(30.0), "to": np.radians(120.0)}
    if CHROMIUM is None:
        return
    with browser(tmp_path) as chromium, chromium.open_at((tmp_path / "run.html").as_uri()) as page:
        assert page.get("k.linkage.ranges[0]") == pytest.approx(np.radians([30.0, 120.0]))
        assert page.get("k.linkage.u[0]") == pytest.approx(np.radians(30.0))
        assert page.tab.locator("#time").is_hidden()
        assert page.get("k.design.fragment()") == ""
        page.tab.click("#tab-plots")
        assert page.tab.get_by_label("Horizontal axis").locator("option").all_inner_texts() == ["crank"]
        page.tab.click("#play")
        page.tab.wait_for_function("window.kinfmu.linkage.u[0] > 0.7")
        assert page.errors == []


@pytest.mark.long
def test_the_page_of_a_run_over_two_drivers_shows_its_samples(tmp_path: Path, command: Command) -> None:
    left, right = np.linspace(2.0, 2.6, 31), 0.8 + 0.2 * np.sin(np.linspace(0.0, 6.0, 31))
    run = kinfmu.solve(kinfmu.load("five_bar"), left_angle=left, right_angle=right, right_speed=0.5)
    write_mcap(run, tmp_path / "run.mcap")
    assert command("export", "run.mcap", "-o", "run.html").exit_code == 0
    data = data_of(tmp_path / "run.html")
    assert data["over"] is None
    assert data["run"] == {"from": 0.0, "to": 30.0, "step": 1.0}
    assert data["samples"]["columns"][0] == [pytest.approx(left), 1.0, 0.0]
    assert data["samples"]["columns"][1] == [pytest.approx(right), 0.5, 0.0]
    if CHROMIUM is None:
        return
    with browser(tmp_path) as chromium, chromium.open_at((tmp_path / "run.html").as_uri()) as page:
        assert page.get("Array.from(k.linkage.u)") == pytest.approx([left[0], right[0]])
        names = page.get("[...k.linkage.index.keys()]")
        for row in (0, 11, 30):
            page.get(f"k.refresh(() => k.linkage.goToTime({row}))")
            page.settle()
            shown = dict(zip(names, page.get("Array.from(k.linkage.pose.q)"), strict=True))
            rates = dict(zip(names, page.get("Array.from(k.linkage.pose.qd)"), strict=True))
            for k, name in enumerate(run.outputs):
                assert shown[name] == pytest.approx(run[name][row], abs=1e-9)
                assert rates[name] == pytest.approx(run.rates[row, k], abs=1e-7)
            assert page.tab.text_content("#clock") == f"sample {row}"
        assert page.tab.get_by_label("Sample", exact=True).get_attribute("max") == "30"
        assert page.tab.get_by_text("Laws of the drivers").count() == 0
        page.tab.click("#tab-plots")
        assert page.tab.get_by_label("Horizontal axis").locator("option").all_inner_texts() == ["sample"]
        page.tab.click("#tab-files")
        with page.tab.expect_download() as saved:
            page.tab.click("#save-time")
        lines = Path(saved.value.path()).read_text("utf-8").splitlines()
        assert lines[0].startswith("sample,")
        assert [float(line.split(",")[0]) for line in lines[1:]] == [*range(31)]
        page.get("k.refresh(() => k.linkage.goToTime(3))")
        page.settle()
        page.tab.click("#play")
        page.tab.wait_for_function("window.kinfmu.linkage.t > 4")
        assert page.get("k.linkage.u[0] > 2.06 && k.linkage.u[0] < 2.4")
        assert page.errors == []


def test_the_page_of_a_run_over_time_shows_samples_only_where_laws_do_not_give_them(
    tmp_path: Path, command: Command
) -> None:
    mech = kinfmu.load("crank_rocker")
    times = np.linspace(0.0, 1.0, 901)
    by_laws = kinfmu.solve(mech, times)
    inputs = by_laws.inputs.copy()
    inputs[:, 0] = 0.3 + times**2
    driven = kinfmu.solve(mech, crank_angle=inputs[:, 0], crank_speed=2.0 * times, crank_acceleration=2.0)
    write_mcap(by_laws, tmp_path / "laws.mcap")
    write_mcap(driven.replaced(axis="time", t=times), tmp_path / "inputs.mcap")
    for name in ("laws", "inputs"):
        assert command("export", f"{name}.mcap", "-o", f"{name}.html").exit_code == 0
    assert data_of(tmp_path / "laws.html")["samples"] is None
    samples = data_of(tmp_path / "inputs.html")["samples"]
    assert samples["isTime"] is True
    assert len(samples["t"]) == 400
    assert samples["t"][-1] == 1.0
    (angle, speed, acceleration), *_ = samples["columns"]
    np.testing.assert_allclose(angle, 0.3 + np.array(samples["t"]) ** 2, atol=1e-11)
    np.testing.assert_allclose(speed, 2.0 * np.array(samples["t"]), atol=1e-11)
    assert acceleration == 2.0


def test_the_page_of_a_run_without_the_values_of_its_drivers_is_refused(
    tmp_path: Path, fails: Callable[..., str]
) -> None:
    angles = np.linspace(2.0, 2.5, 6)
    run = kinfmu.solve(kinfmu.load("five_bar"), left_angle=angles, right_angle=angles - 1.2)
    write_mcap(run.without(["right_angle"]), tmp_path / "run.mcap")
    assert "does not hold right_angle" in fails("export", "run.mcap", "-o", "run.html")
    assert not (tmp_path / "run.html").exists()


def test_a_mechanism_is_exported_as_a_page_only(command: Command, refuses: Callable[..., str], tmp_path: Path) -> None:
    assert command("export", "crank_rocker", "-o", "mech.html").stdout == "written: mech.html\n"
    assert data_of(tmp_path / "mech.html")["run"]["to"] == 2.0
    assert command("export", "crank_rocker", "-o", "fast.html", "--set", "crank.speed=30rpm").exit_code == 0
    parameters = data_of(tmp_path / "fast.html")["modules"]["written"]["parameters"]
    assert [one["value"] for one in parameters if one["name"] == "crank.speed"] == pytest.approx([np.pi])
    assert "of a mechanism only a page (.html) is written" in refuses("export", "crank_rocker", "-o", "mech.csv")
    assert "needs a record (.mcap)" in refuses("export", "crank_rocker", "-o", "mech.html", "--stop", "1")
    assert "not in the gallery" in refuses("export", "run", "-o", "mech.html")


@pytest.mark.long
def test_the_documentation_of_an_fmu_has_the_page(command: Command, tmp_path: Path) -> None:
    for name in ("one", "two"):
        assert command("build", "crank_rocker", "--flavour", "python", "--page", "-o", f"{name}.fmu").exit_code == 0
    assert command("build", "crank_rocker", "--flavour", "python", "--no-page", "-o", "none.fmu").exit_code == 0
    assert (tmp_path / "one.fmu").read_bytes() == (tmp_path / "two.fmu").read_bytes()
    contents = {}
    for name in ("one", "none"):
        with zipfile.ZipFile(tmp_path / f"{name}.fmu") as archive:
            contents[name] = {path: archive.read(path) for path in archive.namelist()}
    page = contents["one"].pop("documentation/play.html").decode()
    assert DATA.search(page)
    assert b'<a href="play.html">' in contents["one"].pop("documentation/index.html")
    assert b"play.html" not in contents["none"].pop("documentation/index.html")
    for listing in ("extra/org.fmi-standard.fmi-ls-ref/fmi-ls-manifest.xml", "extra/org.kinfmu/conformance.json"):
        assert b"documentation/play.html" in contents["one"].pop(listing)
        assert b"documentation/play.html" not in contents["none"].pop(listing)
    assert contents["one"] == contents["none"]


@pytest.mark.long
def test_build_puts_the_page_into_the_documentation_if_asked(tmp_path: Path) -> None:
    mech = kinfmu.load("crank_rocker")
    for page in (True, False):
        path = kinfmu.build(mech, tmp_path / f"{page}.fmu", flavour="python", page=page)
        with zipfile.ZipFile(path) as archive:
            assert ("documentation/play.html" in archive.namelist()) is page


@pytest.mark.long
def test_an_fmu_of_a_mechanism_that_is_too_large_for_a_page(
    command: Command, refuses: Callable[..., str], tmp_path: Path
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("kinfmu.page.html.page_module", _refused)
        assert "too large" in refuses("build", "slider_crank", "--flavour", "python", "--page", "-o", "one.fmu")
        assert not (tmp_path / "one.fmu").exists()
        patch.setattr(BUILD, "_page", PAGE)
        built = command("build", "slider_crank", "--flavour", "python", "-o", "one.fmu")
    assert built.exit_code == 0
    assert built.stderr == "kinfmu: note: the FMU is built without the page of kinfmu play: too large\n"
    with zipfile.ZipFile(tmp_path / "one.fmu") as archive:
        assert "documentation/play.html" not in archive.namelist()


def _refused(*_arguments: object, **_named: object) -> None:
    raise RequestError("too large")


def test_a_mechanism_that_is_too_large_is_refused_before_it_is_checked(
    fails: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kinfmu.page.html.check", None)
    message = fails("export", "fourbar_chain:260", "-o", "chain.html")
    assert message == "fourbar_chain:260: 'fourbar_chain' is too large for a page: it has 520 unknowns, at most 512 fit"
