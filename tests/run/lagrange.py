"""Sympy's Lagrange equations for a four-bar, a slider-crank and a five-bar: `python -m tests.run.lagrange`.

It writes the table that `test_lagrange` reads. Coordinates are angles of bars and places of slides; loops are holonomic
constraints with multipliers. Efforts are the unknowns of the equations, solved together with the multipliers in 40
digits.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

TABLE = Path(__file__).with_name("lagrange.json")
GRAVITY = "0.6", "-9.81"
SPEEDS, ACCELERATIONS = ("1.7", "-0.9"), ("-2.3", "1.1")
ANGLES = [("0.3", "1.9"), ("1.1", "2.2"), ("2.4", "2.0"), ("3.6", "1.6"), ("5.2", "1.8")]
DEAD_CENTRE = 3.0  # [rad] of the crank; a driven slide does not carry it past
DIGITS = 40
MASSES = {  # mass, centre of mass in the body's frame, moment of inertia
    "crank": ("1.2", ("0.4", "0.1"), "0.05"),
    "coupler": ("2.3", ("1.1", "-0.3"), "0.7"),
    "rocker": ("1.9", ("0.8", "0.2"), "0.4"),
    "rod": ("1.4", ("1.3", "0.2"), "0.6"),
    "block": ("3.1", ("0.0", "0.0"), "0.0"),
    "left": ("1.2", ("0.4", "0.1"), "0.05"),
    "right": ("0.9", ("0.5", "-0.1"), "0.06"),
    "forearm": ("1.6", ("0.7", "0.1"), "0.2"),
    "strut": ("1.1", ("0.9", "-0.2"), "0.3"),
}
LENGTHS = {
    "fourbar": {"ground": "3.0", "crank": "1.0", "coupler": "2.8", "rocker": "2.2"},
    "slider_crank": {"crank": "1.0", "rod": "3.0", "offset": "0.3"},
    "five_bar": {"ground": "2.0", "left": "1.0", "right": "1.2", "forearm": "2.1", "strut": "1.9"},
}


def main() -> None:
    """Write the table."""
    import sympy as sp
    from sympy.physics.mechanics import LagrangesMethod, Point, ReferenceFrame, dynamicsymbols

    t = dynamicsymbols._t
    numbers = {name: {bar: sp.Rational(x) for bar, x in bars.items()} for name, bars in LENGTHS.items()}

    def bar(angle: Any, length: Any) -> Any:
        return sp.Matrix([length * sp.cos(angle), length * sp.sin(angle)])

    def problem(name: str) -> dict[str, Any]:
        n = numbers[name]
        if name == "fourbar":
            a, b, c = dynamicsymbols("a b c")
            loop = bar(a, n["crank"]) + bar(b, n["coupler"]) - bar(c, n["rocker"]) - sp.Matrix([n["ground"], 0])
            frames = {"crank": ((0, 0), a), "coupler": (bar(a, n["crank"]), b), "rocker": ((n["ground"], 0), c)}
            return {"q": [a, b, c], "loop": loop, "frames": frames, "driven": {"": [a]}, "guess": [0, 0.7, 1.5]}
        if name == "slider_crank":
            a, b, x = dynamicsymbols("a b x")
            loop = bar(a, n["crank"]) + bar(b, n["rod"]) - sp.Matrix([x, n["offset"]])
            frames = {"crank": ((0, 0), a), "rod": (bar(a, n["crank"]), b), "block": ((x, n["offset"]), sp.Integer(0))}
            return {
                "q": [a, b, x],
                "loop": loop,
                "frames": frames,
                "driven": {"": [a], "slide": [x]},
                "guess": [0, -0.1, 3.0],
            }
        a, e, b, c = dynamicsymbols("a e b c")
        ends = sp.Matrix([n["ground"], 0]) + bar(e, n["right"]), bar(a, n["left"])
        loop = ends[1] + bar(b, n["forearm"]) - ends[0] - bar(c, n["strut"])
        frames = {"left": ((0, 0), a), "right": ((n["ground"], 0), e), "forearm": (ends[1], b), "strut": (ends[0], c)}
        return {"q": [a, e, b, c], "loop": loop, "frames": frames, "driven": {"": [a, e]}, "guess": [0, 0, 0.8, 2.0]}

    table: dict[str, Any] = {}
    for name in LENGTHS:
        one = problem(name)
        q, loop = one["q"], one["loop"]
        world = ReferenceFrame("N")
        origin = Point("O")
        origin.set_vel(world, 0)
        g = [sp.Rational(x) for x in GRAVITY]
        kinetic, potential = sp.Integer(0), sp.Integer(0)
        for body, (at, phi) in one["frames"].items():
            mass, center, inertia = MASSES[body]
            m, (s_x, s_y), moment = sp.Rational(mass), map(sp.Rational, center), sp.Rational(inertia)
            x = at[0] + sp.cos(phi) * s_x - sp.sin(phi) * s_y
            y = at[1] + sp.sin(phi) * s_x + sp.cos(phi) * s_y
            kinetic += m * (sp.diff(x, t) ** 2 + sp.diff(y, t) ** 2) / 2 + moment * sp.diff(phi, t) ** 2 / 2
            potential -= m * (g[0] * x + g[1] * y)
        for mode, driven in one["driven"].items():
            efforts = [dynamicsymbols(f"effort{k}") for k in range(len(driven))]
            forces = []
            for k, coordinate in enumerate(driven):
                if mode == "slide":
                    point = origin.locatenew("S", coordinate * world.x)
                    point.set_vel(world, coordinate.diff(t) * world.x)
                    forces.append((point, efforts[k] * world.x))
                else:
                    turned = world.orientnew(f"A{k}", "Axis", (coordinate, world.z))
                    forces.append((turned, efforts[k] * world.z))
            method = LagrangesMethod(kinetic - potential, q, forcelist=forces, hol_coneqs=list(loop), frame=world)
            equations = method.form_lagranges_equations()
            unknowns = [*efforts, *method.lam_vec]
            table.setdefault(name, {})[mode or "angle"] = [
                _sample(sp, t, one, driven, efforts, equations, unknowns, given)
                for given in ANGLES
                if mode == "" or float(given[0]) < DEAD_CENTRE
            ]
    TABLE.write_text(json.dumps(table, indent=1) + "\n", "utf-8")


def _sample(
    sp: Any,
    t: Any,
    one: dict[str, Any],
    driven: Any,
    efforts: Any,
    equations: Any,
    unknowns: Any,
    given: Any,
) -> dict[str, Any]:
    """Driver values with efforts and reduced inertia at one pose, in decimals."""
    q, loop = one["q"], one["loop"]
    qd, qdd = [x.diff(t) for x in q], [x.diff(t, 2) for x in q]
    free = [x for x in q if x not in one["driven"][""]]
    at = {x: sp.Float(value, DIGITS) for x, value in zip(one["driven"][""], given, strict=False)}
    start = [value for x, value in zip(q, one["guess"], strict=True) if x in free]
    plain = [sp.Symbol(f"z{k}") for k in range(len(free))]
    rows = [row.subs(at).subs(dict(zip(free, plain, strict=True))) for row in loop]
    found = sp.nsolve(rows, plain, start, prec=DIGITS)
    at |= dict(zip(free, found, strict=True))
    follow = [x for x in q if x not in driven]
    jacobian = loop.jacobian(follow).subs(at)

    def motion(speeds: Any, accelerations: Any) -> dict[Any, Any]:
        known = dict(zip([x.diff(t) for x in driven], speeds, strict=True))
        rest = loop.diff(t).subs({x.diff(t): 0 for x in follow}).subs(known).subs(at)
        known |= dict(zip([x.diff(t) for x in follow], -jacobian.LUsolve(rest), strict=True))
        second = dict(zip([x.diff(t, 2) for x in driven], accelerations, strict=True))
        rest = loop.diff(t, 2).subs({x.diff(t, 2): 0 for x in follow}).subs(second).subs(known).subs(at)
        second |= dict(zip([x.diff(t, 2) for x in follow], -jacobian.LUsolve(rest), strict=True))
        return {**second, **known}

    def asked(speeds: Any, accelerations: Any) -> Any:
        moving = motion(speeds, accelerations)
        second, first = ({x: moving[x] for x in part} for part in (qdd, qd))
        numbers = equations.subs(second).subs(first).subs(at)
        matrix, right = sp.linear_eq_to_matrix(list(numbers), unknowns)
        return matrix.LUsolve(right)[: len(efforts)]

    count = len(driven)
    speeds, accelerations = ([sp.Float(x, DIGITS) for x in part[:count]] for part in (SPEEDS, ACCELERATIONS))
    at_rest = asked([sp.Integer(0)] * count, [sp.Integer(0)] * count)
    inertia = []
    for k in range(count):
        moved = asked([sp.Integer(0)] * count, [sp.Integer(int(j == k)) for j in range(count)])
        inertia.append([float(a - b) for a, b in zip(moved, at_rest, strict=True)])
    return {
        "pose": {str(x).partition("(")[0]: float(at[x]) for x in q},
        "driven": [str(at[x]) for x in driven],
        "efforts": [float(x) for x in asked(speeds, accelerations)],
        "inertia": inertia,
    }


if __name__ == "__main__":
    main()
