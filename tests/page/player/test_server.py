"""The server of kinfmu play: what it refuses, how it follows a file, and that its FMU has the numbers of the file."""

from __future__ import annotations

import http.client
import json
import socket
import threading
from collections.abc import Iterator
from http import HTTPStatus
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import kinfmu
from kinfmu.errors import KinfmuError
from kinfmu.mechanism.toml_file import parse
from kinfmu.page.player import PlayServer, PlaySource
from kinfmu.page.player.server import LARGEST_BODY
from tests.page.engines import browser, needs_browser

LENGTH = "bodies.crank.points.P.x"
WAYS = {
    "file": ".toml",
    "driver": ".csv",
    "time": ".csv",
    "svg": ".svg",
    "fmu3": ".fmu",
    "fmu2": ".fmu",
    "page": ".html",
    "gif": ".gif",
    "dxf": ".dxf",
}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "mine.toml"
    kinfmu.save(kinfmu.load("crank_rocker"), path)
    return path


@pytest.fixture
def server(file: Path) -> Iterator[PlayServer]:
    with PlayServer(PlaySource(str(file))) as served:
        yield served


def ask(
    server: PlayServer, place: str = "", method: str = "GET", body: str | bytes | None = None, **headers: str
) -> tuple[int, str]:
    """Return status and text of the answer; place: after the token, or a whole path that starts with '/'."""
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=60)
    path = place if place.startswith("/") else f"/{server.url.split('/')[3]}/{place}"
    connection.request(method, path, body, {name.replace("_", "-"): value for name, value in headers.items()})
    answer = connection.getresponse()
    data = answer.read()
    connection.close()
    return answer.status, data.decode("utf-8", "replace")


def states(server: PlayServer) -> Iterator[dict[str, Any]]:
    """Yield what is reported to pages, apart from pages in the making."""
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=30)
    connection.request("GET", f"/{server.url.split('/')[3]}/changes")
    answer = connection.getresponse()
    assert answer.headers["Content-Type"].startswith("text/event-stream")
    while True:
        line = answer.readline().decode()
        if line.startswith("data: "):
            state = json.loads(line.removeprefix("data: "))
            assert state.pop("editor") == 0  # without a drawing
            if not state.pop("isBusy"):
                yield state


def test_the_page_is_served_to_its_own_address_only(server: PlayServer) -> None:
    status, page = ask(server)
    assert (status, page[:15]) == (HTTPStatus.OK, "<!doctype html>")
    assert 'data-version="1"' in page
    own = f"127.0.0.1:{server.port}"
    assert ask(server, Origin=f"http://{own}")[0] == HTTPStatus.OK
    assert ask(server, Host=f"localhost:{server.port}")[0] == HTTPStatus.OK
    rebound = ask(server, Host=f"evil.example:{server.port}")
    assert rebound == (HTTPStatus.MISDIRECTED_REQUEST, f"only requests to {own} are answered")
    assert ask(server, Host="127.0.0.1")[0] == HTTPStatus.MISDIRECTED_REQUEST
    for origin in ("http://evil.example", "null", f"https://{own}", f"http://127.0.0.1:{server.port + 1}"):
        for place, method in (("", "GET"), ("changes", "GET"), ("fmu3", "POST"), ("file", "POST")):
            assert ask(server, place, method, "", Origin=origin)[0] == HTTPStatus.FORBIDDEN
    assert ask(server, Sec_Fetch_Site="cross-site", Sec_Fetch_Dest="script")[0] == HTTPStatus.FORBIDDEN
    assert ask(server, Sec_Fetch_Site="cross-site", Sec_Fetch_Dest="document")[0] == HTTPStatus.OK  # a link
    assert ask(server, "file", "POST", "", Sec_Fetch_Site="same-site")[0] == HTTPStatus.FORBIDDEN


def test_other_paths_tokens_and_methods_are_refused(server: PlayServer, file: Path) -> None:
    token = server.url.split("/")[3]
    assert len(token) >= 32
    outside = [
        "/",
        f"/{token}",
        f"/{token[:-1]}/",
        f"/{token}x/",
        "//",
        f"/../{token}/",
        "/favicon.ico",
        f"/{token.lower()}/",
    ]
    inside = [f"/{token}/mine.toml", f"/{token}/../mine.toml", f"/{token}/..%2fmine.toml", f"/{token}//etc/passwd"]
    for path in (*outside, *inside, f"/{token}/fmu3", f"/{token}/file"):
        assert ask(server, path)[0] == HTTPStatus.NOT_FOUND, path
    assert ask(server, "changes", "POST", "")[0] == HTTPStatus.NOT_FOUND
    assert ask(server, "file", "PUT", "x")[0] == HTTPStatus.NOT_IMPLEMENTED
    assert [path.name for path in file.parent.iterdir()] == ["mine.toml"]


def test_only_bodies_of_mechanism_files_within_the_limit_are_read(server: PlayServer, file: Path) -> None:
    at = (server, "file", "POST")
    too_large = ask(*at, None, Content_Length=str(LARGEST_BODY + 1))
    assert too_large == (HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"at most {LARGEST_BODY} bytes are read")
    assert ask(*at, None, Content_Length="9" * 5000)[0] == HTTPStatus.REQUEST_ENTITY_TOO_LARGE
    for length in ("-1", "1e3", "\u00b2", "0x10", ""):
        with socket.create_connection(("127.0.0.1", server.port), timeout=30) as raw:
            path = f"/{server.url.split('/')[3]}/file"
            lines = f"POST {path} HTTP/1.1", f"Host: 127.0.0.1:{server.port}", f"Content-Length: {length}", "", ""
            raw.sendall("\r\n".join(lines).encode())
            assert b" 411 " in raw.makefile("rb").readline()
    assert ask(*at, b"\xff\xfe")[0] == HTTPStatus.BAD_REQUEST
    assert ask(*at, "name = ")[0] == HTTPStatus.UNPROCESSABLE_ENTITY
    status, message = ask(*at, file.read_text("utf-8").replace('"revolute"', '"revolut"', 1))
    assert status == HTTPStatus.UNPROCESSABLE_ENTITY
    assert "did you mean 'revolute'?" in message
    assert [path.name for path in file.parent.iterdir()] == ["mine.toml"]


@pytest.mark.long
def test_a_malformed_file_is_reported_and_the_next_good_one_is_shown(server: PlayServer, file: Path) -> None:
    good, reports = file.read_text("utf-8"), states(server)
    assert next(reports) == {"version": 1, "problem": ""}
    file.write_text(good.replace('"revolute"', '"revolut"', 1), "utf-8")
    broken = next(reports)
    assert broken["version"] == 1
    assert broken["problem"].startswith(f"{file}: ")
    assert "did you mean 'revolute'?" in broken["problem"]
    assert ask(server)[0] == HTTPStatus.OK  # still the last good one
    file.unlink()
    assert "mine.toml" in next(reports)["problem"]
    file.write_text(good, "utf-8")
    assert next(reports) == {"version": 1, "problem": ""}  # the same page
    file.write_text(good.replace("Crank-rocker that", "A crank-rocker that"), "utf-8")
    assert next(reports) == {"version": 2, "problem": ""}
    assert 'data-version="2"' in ask(server)[1]


@pytest.mark.long
def test_the_fmu_and_the_saved_file_have_the_lengths_as_set(server: PlayServer, file: Path, tmp_path: Path) -> None:
    content = file.read_text("utf-8").replace("P = [20", "P = [22")
    mech = parse(content)
    assert ask(server, "file", "POST", content) == (HTTPStatus.OK, str(file.with_name("mine-2.toml")))
    assert ask(server, "file", "POST", content) == (HTTPStatus.OK, str(file.with_name("mine-3.toml")))
    assert kinfmu.load(tmp_path / "mine-2.toml") == mech
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=120)
    connection.request("POST", f"/{server.url.split('/')[3]}/fmu2", content)
    answer = connection.getresponse()
    (tmp_path / "set.fmu").write_bytes(answer.read())
    assert answer.status == HTTPStatus.OK
    run = kinfmu.simulate(tmp_path / "set.fmu")
    expected = kinfmu.solve(mech, run.t)
    np.testing.assert_array_equal(run["coupler.x"], expected["coupler.x"])
    assert run["coupler.x"].max() == pytest.approx(22)


def test_a_port_in_use_is_reported(server: PlayServer) -> None:
    with pytest.raises(KinfmuError, match=rf"^port {server.port} cannot be used \(Address already in use\); choose"):
        PlayServer(server.source, server.port)


@needs_browser
@pytest.mark.long
def test_the_page_works_under_its_security_policy(server: PlayServer, tmp_path: Path) -> None:
    with browser(tmp_path) as chromium, chromium.tab() as page:
        page.tab.goto(server.url)
        page.tab.locator("#name", has_text="crank").wait_for()
        page.tab.click("#tab-files")
        page.tab.click("#keep-file")
        page.tab.locator("#served", has_text="Saved: ").wait_for()
        server.__exit__(None, None, None)
        page.tab.locator("#file-problem", has_text="kinfmu play has ended").wait_for()
        assert page.tab.locator("#save-fmu3").is_disabled()
        assert all("ERR_" in error for error in page.errors)  # the server is gone


@needs_browser
@pytest.mark.long
def test_while_a_page_is_made_the_old_one_states_it_and_goes_on(
    server: PlayServer, file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, may_end = server.source._page_of, threading.Event()

    def slow(mechanism: kinfmu.Mechanism) -> str:
        may_end.wait(60.0)
        return made(mechanism)

    monkeypatch.setattr(server.source, "_page_of", slow)
    with browser(tmp_path) as chromium, chromium.open_at(server.url, bypass_csp=True) as page:
        busy = page.tab.locator("#file-busy")
        assert busy.is_hidden()
        drawn = page.get("k.canvas.toDataURL()")
        size = page.get("[k.view.width, k.view.height]")
        file.write_text(file.read_text("utf-8").replace("Crank-rocker that", "A crank-rocker that"), "utf-8")
        busy.wait_for(state="visible")
        assert busy.inner_text().startswith("The file was saved. Its page is being made")
        assert page.get("[k.view.width, k.view.height]") == size
        assert page.get("k.canvas.toDataURL()") == drawn
        page.move(1.0)
        assert page.get("k.linkage.u[0]") == 1.0
        may_end.set()
        page.tab.wait_for_function("document.getElementById('title').textContent.startsWith('A crank')")


@needs_browser
def test_the_page_keeps_its_values_across_a_reload_and_builds_the_fmu(
    server: PlayServer, file: Path, tmp_path: Path
) -> None:
    good = file.read_text("utf-8")
    with browser(tmp_path) as chromium, chromium.open_at(server.url, bypass_csp=True) as page:
        page.get(f"(k.design.set({{'{LENGTH}': 22}}), k.design.commit(), k.reshape(), k.move(0, 1.25))")
        page.settle()
        page.tab.click("#tab-files")
        line = page.tab.locator("#file-problem")
        file.write_text(good + "\nwrong", "utf-8")
        line.wait_for(state="visible")
        assert line.inner_text().startswith(f"The file cannot be used as it is: {file}: not valid TOML")
        file.write_text(good.replace("Crank-rocker that", "A crank-rocker that"), "utf-8")
        page.tab.wait_for_function(
            "window.kinfmu && document.getElementById('title').textContent.startsWith('A crank')"
        )
        page.settle()
        assert line.is_hidden()
        assert page.get(f"[k.design.values.get('{LENGTH}'), k.linkage.u[0]]") == pytest.approx([22, 1.25], abs=1e-12)
        assert page.tab.locator("#tab-files").get_attribute("aria-selected") == "true"
        pose = page.get("k.linkage.pose.q[[...k.linkage.index.keys()].indexOf('rocker.phi')]")
        with page.tab.expect_download() as download:
            page.tab.click("#save-fmu2")
        download.value.save_as(tmp_path / "page.fmu")
        page.tab.click("#keep-file")
        page.tab.wait_for_function("document.getElementById('served').textContent.startsWith('Saved: ')")
        assert page.errors == []
    saved = kinfmu.load(tmp_path / "mine-2.toml")
    assert saved.body_points["crank.P"] == (22, 0)
    run = kinfmu.simulate(tmp_path / "page.fmu")
    np.testing.assert_array_equal(run["rocker.phi"], kinfmu.solve(saved, run.t)["rocker.phi"])
    assert kinfmu.solve(saved, crank_angle=[1.25])["rocker.phi"][0] == pytest.approx(pose, abs=1e-12)


@needs_browser
@pytest.mark.long
def test_a_design_is_saved_in_every_way_by_clicks(server: PlayServer, tmp_path: Path) -> None:
    pytest.importorskip("ezdxf")
    import ezdxf

    with browser(tmp_path) as chromium, chromium.open_at(server.url, bypass_csp=True) as page:
        page.tab.context.grant_permissions(["clipboard-read", "clipboard-write"])
        field = page.tab.get_by_label("crank length mm", exact=True)
        field.fill("22")
        field.press("Enter")
        page.move(1.25)
        page.get("k.address.write()")
        page.tab.click("#tab-files")
        saved: dict[str, Path] = {}
        for name, suffix in WAYS.items():
            with page.tab.expect_download() as download:
                page.tab.click(f"#save-{name}")
            assert download.value.suggested_filename == f"crank_rocker{suffix}"
            saved[name] = tmp_path / f"{name}{suffix}"
            download.value.save_as(saved[name])
            page.tab.wait_for_function("!document.querySelector('#files .buttons button:disabled')")
        page.tab.click("text=Copy the address")
        page.tab.locator("text=Copied").wait_for()
        link = page.tab.evaluate("navigator.clipboard.readText()")
        pin = page.get("k.linkage.point(k.linkage.data.points.findIndex(({ name }) => name === 'tracer'))")
        assert page.errors == []
        with chromium.open_at(link, bypass_csp=True) as shared:
            assert shared.get(f"[k.design.values.get('{LENGTH}'), k.linkage.u[0]]") == [22, pytest.approx(1.25)]
        with chromium.open(saved["page"].read_text("utf-8")) as alone:
            assert alone.get(f"k.design.values.get('{LENGTH}')") == 22
            assert alone.errors == alone.requests == []
    mech = kinfmu.load(saved["file"])
    assert mech.body_points["crank.P"] == (22, 0)
    table = np.genfromtxt(saved["time"], delimiter=",", names=True, deletechars="")
    whole = kinfmu.solve(mech, table["time_[s]"])
    np.testing.assert_allclose(table["tracer.y_[mm]"], whole["tracer.y"], atol=1e-9)
    assert len(np.genfromtxt(saved["driver"], delimiter=",", names=True, deletechars="")) == 361
    for name in ("fmu2", "fmu3"):
        run = kinfmu.simulate(saved[name])
        np.testing.assert_allclose(run["tracer.y"], kinfmu.solve(mech, run.t)["tracer.y"], atol=1e-9)
    assert saved["svg"].read_text("utf-8").startswith("<svg ")
    points = [one.dxf.location for one in ezdxf.readfile(saved["dxf"]).modelspace().query("POINT")]
    assert min(np.hypot(one.x - pin[0], one.y - pin[1]) for one in points) < 1e-6
    with Image.open(saved["gif"]) as gif:
        assert (gif.format, gif.n_frames > 10) == ("GIF", True)


@pytest.mark.parametrize("query", ["", "?values=x", "?values=1&values=2", "?values=inf", "?values=nan"])
def test_a_drawing_of_a_pose_needs_the_values_of_its_drivers(server: PlayServer, file: Path, query: str) -> None:
    assert ask(server, f"dxf{query}", "POST", file.read_text("utf-8")) == (
        HTTPStatus.BAD_REQUEST,
        "values= is required: a number for each driver",
    )
