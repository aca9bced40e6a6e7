"""Reports as verdicts and tables: every level, widths, what a sound mechanism leaves out, HTML."""

from __future__ import annotations

import re
from dataclasses import replace

import kinfmu
from kinfmu.display import Poor, Summary, Table, Verdict
from kinfmu.mechanism import gallery
from kinfmu.mechanism.measures import Range
from tests.gallery_members import every_member
from tests.mechanisms import fourbar, reference_fourbar
from tests.reports import unwrapped

WIDTHS = [60, 80, 120]


def levels(mechanism: kinfmu.Mechanism) -> dict[str, list[str]]:
    """The texts of the verdicts on a mechanism by level."""
    found: dict[str, list[str]] = {}
    for verdict in kinfmu.check(mechanism).summary().verdicts:
        found.setdefault(verdict.level, []).append(verdict.text)
    return found


def test_a_sound_mechanism_has_verdicts_that_are_ok_and_no_line_without_news() -> None:
    report = kinfmu.check(kinfmu.load("double_crank"))
    assert unwrapped(report, detail=False) == (
        "Double crank (drag link) double_crank\n\n"
        " ok Moves with one driver: crank turns all the way round\n"
        " ok 3 moving bodies, 4 joints, mobility 1, no redundant constraint\n"
        " ok No singular pose in the range\n"
        " ok Transmission angle 40 deg or more from 0 and 180 deg\n\n"
        " loop lengths [mm] class\n"
        " ground, crank, coupler, follower 20, 60, 55, 60 double crank, open\n\n"
        " transmission angle smallest largest worst at crank\n"
        " coupler, follower 40.42 deg 88.05 deg 0 deg"
    )
    detail = unwrapped(report)
    for subject in ("bodies", "joint rows", "start", "assembled", "coordinates", "fixed", "block 1"):
        assert f"\n {subject} " in detail
    assert " shortest + longest 80 < the others 115\n" in detail
    assert "determinant " in detail


def test_every_level_has_its_verdicts() -> None:
    redundant = levels(reference_fourbar())
    assert redundant["note"] == [
        "AB is redundant: it follows from O, P, C, Q; set aside, residual monitored",
        "Branches cross at crank = 0 deg, 180 deg; the motion goes on (bridged)",
    ]
    assert levels(kinfmu.load("jansen_leg"))["poor"] == [
        "Transmission angle 8.648 deg between lower_rod and lower_rocker (40 deg from 0 and 180 deg is usual)"
    ]
    rocking = levels(fourbar(4.0, 3.0, 3.5, 2.0))
    assert [text.partition(" takes crank from ")[0] for text in rocking["poor"]] == ["[run]"]
    broken = levels(replace(fourbar(4, 1, 3.5, 3), drivers=()))
    assert [text.partition(":")[0] for text in broken["problem"]] == ["[drivers] mobility is 1 but there is no driver"]
    assert broken["advice"][0].startswith("drive crank: nothing drives the mechanism; leads to: mobility 1, ")
    assert [*broken] == ["note", "problem", "advice"]
    assert broken["note"] == ["3 moving bodies, 4 joints, mobility 1, no redundant constraint, no driver"]


def test_a_limited_range_is_stated_with_the_reason_of_its_limits() -> None:
    assert levels(kinfmu.load("triple_rocker"))["ok"][0] == (
        "Moves with one driver: left from -85.59 deg to 85.59 deg; dead centre at both ends, "
        "coupler and right fall in line"
    )
    summary = kinfmu.check(kinfmu.load("excavator")).summary()
    assert summary.tables[0].rows[0] == ("boom_cylinder", "dead centre at both ends", "1.923 m", "3.204 m")


def test_a_measure_without_a_value_is_listed_with_its_reason() -> None:
    mechanism = kinfmu.load("triple_rocker")
    run = replace(mechanism.run, over="turn")
    text = unwrapped(kinfmu.check(replace(mechanism, run=run, measures=(Range("swing", "right.phi"),))), detail=False)
    assert " note swing: no value, because over = 'turn' needs a single driver" in text


@every_member
def test_reports_keep_to_the_width_and_lose_no_word(name: str) -> None:
    report = kinfmu.check(gallery.load(name))
    summary = report.summary()
    words = sorted(unwrapped(report, detail=False).split())
    for width in WIDTHS:
        lines = summary.text(width).splitlines()
        assert max(map(len, lines)) <= width
        is_cut = name == "excavator_loaded" and width == 60  # names of 44 letters
        assert (sorted(" ".join(lines).split()) == words) is not is_cut
    assert str(report) == summary.text(80)
    coloured = re.sub(r"\x1b\[[0-9;]*m", "", summary.text(80, colour=True))
    assert [line.rstrip() for line in coloured.splitlines()] == str(report).splitlines()


def test_long_names_are_shortened_in_the_middle_and_break_on_pages() -> None:
    long = "second_coupler_of_the_watt_six_bar_mechanism"
    table = Table(("angle", "smallest"), ((f"{long}, output", "34.76 deg"), ("rod, slider", "62.72 deg")))
    summary = Summary("name", "", (), (table,))
    assert summary.text(40).splitlines()[3:] == [
        "  angle                         smallest",
        "  second_coupl\N{HORIZONTAL ELLIPSIS}r_mechanism,    34.76 deg",
        "    output",
        "  rod, slider                  62.72 deg",
    ]
    assert f"{long}, output" in summary.text(80)
    assert "second_<wbr>coupler_<wbr>of" in summary.html()


def test_the_page_has_what_the_text_has() -> None:
    table = Table(("link", "length"), (("a & b", Poor("<1 mm")),), caption="Lengths")
    summary = Summary("name", "Title", (Verdict("poor", "thin <a>", ("leads to: rest",)),), (table,))
    assert summary.text(80).splitlines() == [
        "Title  name",
        "",
        "  poor  thin <a>",
        "          leads to: rest",
        "",
        "        Lengths",
        "        link   length",
        "        a & b   <1 mm",
    ]
    html = summary.html()
    assert 'class=poor style="' in html
    for text in ("thin &lt;a&gt;\nleads to: rest", "<p>Lengths</p>", "a &amp; b", ">&lt;1 mm</td>"):
        assert text in html


def test_long_names_break_the_lines_of_a_table_between_words_only() -> None:
    rows = (("first_link_of_all, second_link_of_all", "12 mm"),)
    lines = Summary("n", "", (), (Table(("loop", "length"), rows),)).text(32).splitlines()
    assert lines[3:] == [
        "    loop                  length",
        "    first_link_of_all,     12 mm",
        "      second_link_of_all",
    ]
