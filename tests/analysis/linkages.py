"""Mechanisms whose ranges are known in closed form."""

from __future__ import annotations

import math

from kinfmu import AngleDriver, Body, ConstantSpeed, Coordinate, DistanceDriver, Mechanism, Revolute, SlideDriver
from kinfmu import Translational as Slide


def five_bar_arm(upper: float = 1.5, start: tuple[float, float] = (1.2, 2.0)) -> Mechanism:
    """A five-bar with cranks of 1 on pivots 3 apart and two arms of the same length, driven at both cranks."""
    (px, py), (qx, qy) = ((x + math.cos(angle), math.sin(angle)) for x, angle in zip((0.0, 3.0), start, strict=True))
    half, lean = 0.5 * math.hypot(qx - px, qy - py), math.atan2(qy - py, qx - px)
    rise = math.acos(half / upper)
    return Mechanism(
        "five_bar_arm",
        [
            Body("ground", {"A": (0, 0), "B": (3, 0)}),
            Body("left", {"A": (0, 0), "P": (1, 0)}, (0, 0, start[0])),
            Body("right", {"B": (0, 0), "Q": (1, 0)}, (3, 0, start[1])),
            Body("forearm", {"P": (0, 0), "T": (upper, 0)}, (px, py, lean + rise)),
            Body("strut", {"Q": (0, 0), "T": (upper, 0)}, (qx, qy, lean + math.pi - rise)),
        ],
        [
            Revolute("A", ("ground.A", "left.A")),
            Revolute("B", ("ground.B", "right.B")),
            Revolute("P", ("left.P", "forearm.P")),
            Revolute("Q", ("right.Q", "strut.Q")),
            Revolute("T", ("forearm.T", "strut.T")),
        ],
        [
            AngleDriver("shoulder", "left", ConstantSpeed(start[0], 0.1)),
            AngleDriver("elbow", "right", ConstantSpeed(start[1], -0.1)),
        ],
    )


def digger(foot: float = 1.1, lug: float = 2.0) -> Mechanism:
    """A boom and a stick moved by cylinders: the boom's between a ground point `foot` below its pin and a lug on it."""
    return Mechanism(
        "digger",
        [
            Body("ground", {"O": (0, 0), "foot": (0, -foot)}),
            Body("boom", {"O": (0, 0), "lug": (lug, 0), "rear": (2.5, 0.4), "E": (4, 0)}, (0, 0, 0.5)),
            Body("stick", {"E": (0, 0), "tail": (-0.7, 0.2), "tip": (2, 0)}, (3.5, 1.9, -0.9)),
        ],
        [Revolute("O", ("ground.O", "boom.O")), Revolute("E", ("boom.E", "stick.E"))],
        [
            DistanceDriver("lift", ("ground.foot", "boom.lug"), ConstantSpeed(2.6, 0.01)),
            DistanceDriver("crowd", ("boom.rear", "stick.tail"), ConstantSpeed(1.3, 0.01)),
        ],
    )


def pushed_crank(crank: float = 1.0, rod: float = 2.5, offset: float = 0.3) -> Mechanism:
    """A slider-crank with a slider, which drives the crank."""
    start = 0.8
    px, py = crank * math.cos(start), crank * math.sin(start)
    x = px + math.sqrt(rod**2 - (py - offset) ** 2)
    return Mechanism(
        "pushed_crank",
        [
            Body("ground", {"O": (0, 0), "G": (0, offset)}),
            Body("crank", {"O": (0, 0), "P": (crank, 0)}, (0, 0, start)),
            Body("rod", {"P": (0, 0), "S": (rod, 0)}, (px, py, math.atan2(offset - py, x - px))),
            Body("slider", {"S": (0, 0)}, (x, offset, 0)),
        ],
        [
            Revolute("O", ("ground.O", "crank.O")),
            Revolute("P", ("crank.P", "rod.P")),
            Revolute("S", ("rod.S", "slider.S")),
            Slide("guide", ("ground.G", "slider.S")),
        ],
        [SlideDriver("push", ("ground.G", "slider.S"), 0.0, ConstantSpeed(x, 0.01))],
    )


def pinned_by_coordinates(ground: float, crank: float, coupler: float, rocker: float, start: float = 1.0) -> Mechanism:
    """A four-bar whose ground pins are held coordinates, its bodies out of order, its coupler driven by no one."""
    px, py = crank * math.cos(start), crank * math.sin(start)
    diagonal = math.hypot(ground - px, py)
    along = (coupler**2 - rocker**2 + diagonal**2) / (2.0 * diagonal)
    lean = math.atan2(-py, ground - px) + math.acos(along / coupler)
    qx, qy = px + coupler * math.cos(lean), py + coupler * math.sin(lean)
    return Mechanism(
        "pinned_by_coordinates",
        [
            Body("rocker", {"C": (0, 0), "Q": (0, rocker)}, (ground, 0, math.atan2(qy, qx - ground) - math.pi / 2)),
            Body("coupler", {"P": (0, 0), "Q": (coupler, 0)}, (px, py, lean)),
            Body("crank", {"O": (0, 0), "P": (crank, 0)}, (0, 0, start)),
        ],
        [
            Coordinate("Cx", "rocker.C", "x", ground),
            Coordinate("Cy", "rocker.C", "y", 0.0),
            Revolute("Q", ("rocker.Q", "coupler.Q")),
            Revolute("P", ("coupler.P", "crank.P")),
            Coordinate("Ox", "crank.O", "x", 0.0),
            Coordinate("Oy", "crank.O", "y", 0.0),
        ],
        [AngleDriver("crank", "crank", ConstantSpeed(start, 1.0))],
    )
