"""kinfmu export to a page: the parameters and the time of a run, and pages of mechanisms."""

from __future__ import annotations

import base64
import gzip
import json
import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu.errors import CompilerError
from kinfmu.log import write_mcap
from tests.cli.conftest import Command, command, fails, refuses
from tests.page.browser import CHROMIUM, browser

pytest.importorskip("ziglang", reason="pages are compiled by zig")
DATA = re.compile(r'id="data">([^<]*)<')
__all__ = ["command", "fails", "refuses"]  # fixtures


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


def test_a_mechanism_is_exported_as_a_page_only(command: Command, refuses: Callable[..., str], tmp_path: Path) -> None:
    assert command("export", "crank_rocker", "-o", "mech.html").stdout == "written: mech.html\n"
    assert data_of(tmp_path / "mech.html")["run"]["to"] == 2.0
    assert "of a mechanism only a page (.html) is written" in refuses("export", "crank_rocker", "-o", "mech.csv")
    assert "needs a record (.mcap)" in refuses("export", "crank_rocker", "-o", "mech.html", "--stop", "1")
    assert "not in the gallery" in refuses("export", "run", "-o", "mech.html")


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
    assert contents["one"] == contents["none"]


def test_build_puts_the_page_into_the_documentation_if_asked(tmp_path: Path) -> None:
    mech = kinfmu.load("crank_rocker")
    for page in (True, False):
        path = kinfmu.build(mech, tmp_path / f"{page}.fmu", flavour="python", page=page)
        with zipfile.ZipFile(path) as archive:
            assert ("documentation/play.html" in archive.namelist()) is page


def test_an_fmu_whose_page_cannot_be_compiled(command: Command, fails: Callable[..., str], tmp_path: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("kinfmu.codegen.c.compiler.wasm_module", _refused)
        assert "zig fails" in fails("build", "slider_crank", "--flavour", "python", "--page", "-o", "one.fmu")
        assert not (tmp_path / "one.fmu").exists()
        patch.setattr("kinfmu.cli.build.find_spec", lambda _name: True)
        built = command("build", "slider_crank", "--flavour", "python", "-o", "one.fmu")
    assert built.exit_code == 0
    assert built.stderr == "kinfmu: note: the FMU is built without the page of kinfmu play: zig fails\n"
    with zipfile.ZipFile(tmp_path / "one.fmu") as archive:
        assert "documentation/play.html" not in archive.namelist()


def _refused(*_arguments: object) -> bytes:
    raise CompilerError("zig fails")
