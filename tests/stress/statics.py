"""Free-body diagrams in 50 digits: efforts and reactions of a mechanism file, sharing no code with kinfmu.

Each body has three equations, M qdd - Q = sum of its rows' gradients times their multipliers, in SI units; Q are
gravity and loads. Poses, rates and accelerations are found by Newton with power series in 80 digits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import qr

from tests.power_series import Series, mp, sin_cos
from tests.stress.sensitivities import CLOSED, Floats, Rows

METRES = {"m": mp.mpf(1), "mm": mp.mpf("0.001")}
NOUNS = {  # of reactions by joint type, one for each row
    "revolute": ("force_x", "force_y"),
    "distance": ("force",),
    "point_on_line": ("force",),
    "translational": ("force", "moment"),
    "gear": ("moment",),
}
CONSERVATIVE = ("spring", "gas_spring", "torsion_spring")
ITERATIONS = 40


class Frame(NamedTuple):
    """A body in SI units, numbers of any kind."""

    x: Any
    y: Any
    c: Any
    s: Any
    phi: Any
    vx: Any
    vy: Any
    omega: Any


STANDING = Frame(0, 0, 1, 0, 0, 0, 0, 0)


class Loads:
    """What the loads of a file exert. points: in the file's unit."""

    def __init__(self, file: Mapping[str, Any], points: Mapping[str, Any], number: Callable[[Any], Any]) -> None:
        self._number = number
        self._metre = number(METRES[file["units"]["length"]])
        self._points = {name: tuple(number(x) * self._metre for x in point) for name, point in points.items()}
        self._loads = file.get("loads", {})

    def exerted(
        self, frames: Mapping[str, Frame], root: Callable[[Any], Any], *, but: Sequence[str] = ()
    ) -> dict[str, list[Any]]:
        """Forces and the moment about its origin on each body; but: types of loads to leave out."""
        found: dict[str, list[Any]] = {name: [0, 0, 0] for name in frames}

        def arm(point: str) -> tuple[Any, Any]:
            frame, (a, b) = frames[point.split(".")[0]], self._points[point]
            return frame.c * a - frame.s * b, frame.s * a + frame.c * b

        def push(point: str, x: Any, y: Any) -> None:
            (a, b), on = arm(point), found[point.split(".")[0]]
            on[0], on[1], on[2] = on[0] + x, on[1] + y, on[2] + (y * a - x * b)

        for load in self._loads.values():
            kind = load["type"]
            value = {key: self._number(x) for key, x in load.items() if not isinstance(x, str | list | dict)}
            if kind in but:
                continue
            if kind in ("force", "force_along"):
                axes = frames[load.get("axes", "ground")]
                if kind == "force":
                    x, y = value["x"], value["y"]
                else:
                    x, y = (value["level"] * self._number(of(load["angle"])) for of in (mp.cos, mp.sin))
                push(load["at"], axes.c * x - axes.s * y, axes.s * x + axes.c * y)
            elif kind in ("torsion_spring", "torsion_damper"):
                one, other = load["between"]
                if kind == "torsion_spring":
                    effort = (frames[other].phi - frames[one].phi - value["free_angle"]) * -value["stiffness"]
                else:
                    effort = (frames[other].omega - frames[one].omega) * -value["damping"]
                found[other][2], found[one][2] = found[other][2] + effort, found[one][2] - effort
            elif kind == "torque":
                effort = frames[load["over"]["of"]].phi * value["speed"] + value["start"]
                one, other = load["against"], load["on"]
                found[other][2], found[one][2] = found[other][2] + effort, found[one][2] - effort
            else:
                ends = []
                for point in load["between"]:
                    (a, b), frame = arm(point), frames[point.split(".")[0]]
                    ends.append((frame.x + a, frame.y + b, frame.vx - frame.omega * b, frame.vy + frame.omega * a))
                dx, dy, dvx, dvy = (b - a for a, b in zip(*ends, strict=True))
                length = root(dx * dx + dy * dy)
                if kind == "spring":
                    effort = (length - value["free_length"] * self._metre) * -value["stiffness"] - value["preload"]
                elif kind == "gas_spring":
                    slope = (value["compressed_force"] - value["extended_force"]) / (value["stroke"] * self._metre)
                    effort = (value["extended_length"] * self._metre - length) * slope + value["extended_force"]
                elif kind == "damper":
                    effort = (dx * dvx + dy * dvy) / length * -value["damping"]
                else:
                    raise NotImplementedError(kind)
                x, y = effort * dx / length, effort * dy / length
                push(load["between"][1], x, y)
                push(load["between"][0], -x, -y)
        return found


class Balance(NamedTuple):
    """What holds a mechanism in its motion, at one sample.

    efforts: of the drivers; reactions: by name; shared: names of reactions to which a self-stress may be added;
    open: what the rows balance along each coordinate; gradients: of the rows, one row each (rows, coordinates); per:
    effort of each row, or reaction, over its multiplier; inertias: the reduced inertia, a matrix; shaking: force (x, y)
    and moment on the ground.
    """

    efforts: Floats
    reactions: dict[str, float]
    shared: set[str]
    open: Floats
    gradients: Floats
    per: Floats
    inertias: Floats
    shaking: Floats


class Statics:
    """The equations of a file, its numbers in many digits."""

    def __init__(self, file: Mapping[str, Any]) -> None:
        self.rows = Rows(file)
        self.file = file
        self.metre = METRES[file["units"]["length"]]
        self.loads = Loads(file, self.rows.points, mp.mpf)
        self.names = [f"{name}.{noun}" for name, joint in file["joints"].items() for noun in NOUNS[joint["type"]]]

    def jacobian(self, q: Sequence[Any], u: Sequence[Any]) -> Any:
        """Gradients of all rows, an mp matrix (rows, coordinates)."""
        columns = []
        for k in range(len(q)):
            moved = [Series([value, int(j == k)]) for j, value in enumerate(q)]
            rows = self.rows.residual(moved, u, {})
            columns.append([row.c[1] if isinstance(row, Series) else mp.mpf(0) for row in rows])
        return mp.matrix(columns).T

    def at(self, guess: Floats, u: Sequence[Any], ud: Sequence[Any], udd: Sequence[Any], size: float) -> Balance:
        """The forces near a pose in doubles, (3 n,)."""
        q = [mp.mpf(float(value)) for value in guess]
        plain = [mp.mpf(value) for value in u]
        gradients = np.array(self.jacobian(q, plain).tolist(), dtype=float)
        unit = np.tile([1.0, 1.0, 1.0 / size], len(self.rows.bodies))  # of a coordinate's shift by the size, by 1 rad
        scaled = gradients * unit
        scaled /= np.linalg.norm(scaled, axis=1)[:, None]
        *_, order = qr(scaled.T, mode="economic", pivoting=True)
        chosen = sorted(order[: len(q)].tolist())
        inverse = mp.matrix(np.linalg.inv(gradients[chosen]).tolist())
        moved = self._moved(q, [Series([a, b, c / 2]) for a, b, c in zip(plain, ud, udd, strict=True)], chosen, inverse)
        exact = self.jacobian([one.c[0] for one in moved], plain)
        open_ones, of_loads = self._open(moved)
        square = mp.matrix([[exact[k, j] for k in chosen] for j in range(len(q))])
        multipliers = [mp.mpf(0)] * exact.rows
        for k, one in zip(chosen, mp.lu_solve(square, mp.matrix(open_ones)), strict=True):
            multipliers[k] = one
        per = self._per(plain)
        forces = [float(a * b) for a, b in zip(multipliers, per, strict=True)]
        count = len(self.names)
        _, values, left = np.linalg.svd(scaled[:count].T)
        rank = int((values > 1e-9 * values[0]).sum())
        stress = np.abs(left[rank:]).max(axis=0, initial=0.0)
        return Balance(
            efforts=np.array(forces[count:]),
            reactions=dict(zip(self.names, forces, strict=False)),
            shared={name for name, part in zip(self.names, stress, strict=True) if part > 1e-6},
            open=np.array([float(one) for one in open_ones]),
            gradients=np.array(exact.tolist(), dtype=float),
            per=np.array([float(one) for one in per]),
            inertias=self._inertias(square, chosen, per, [one.c[0] for one in moved]),
            shaking=self._shaking(exact, multipliers, [one.c[0] for one in moved], of_loads),
        )

    def _moved(self, q: list[Any], u: Sequence[Series], chosen: Sequence[int], inverse: Any) -> list[Series]:
        """Coordinates with their rates and half accelerations, by Newton with one Jacobian."""
        found = [Series([value, 0, 0]) for value in q]
        for _ in range(ITERATIONS):
            rows = self.rows.residual(found, u, {})
            parts = [row.c if isinstance(row, Series) else [mp.mpf(row), 0, 0] for row in rows]
            steps = [inverse * mp.matrix([parts[k][order] for k in chosen]) for order in range(3)]
            found = [Series(a - step[k] for a, step in zip(one.c, steps, strict=True)) for k, one in enumerate(found)]
            largest = max(abs(entry) for one in found for entry in one.c)
            if max(abs(entry) for step in steps for entry in step) < CLOSED * (1 + largest):
                return found
        raise ArithmeticError("Newton does not converge")

    def _center(self, of: Mapping[str, Any], x: Any, y: Any, phi: Any) -> tuple[Any, Any, Any, Any]:
        """Arm and place of a centre of mass in SI units."""
        s, c = sin_cos(phi)
        a, b = (mp.mpf(value) * self.metre for value in of.get("center_of_mass", (0, 0)))
        arm_x, arm_y = c * a - s * b, s * a + c * b
        return arm_x, arm_y, x * self.metre + arm_x, y * self.metre + arm_y

    def _shaking(self, rows: Any, multipliers: Sequence[Any], q: Sequence[Any], of_loads: Sequence[Any]) -> Floats:
        """Force and moment on the ground: what all rows exert on it, against what they exert on bodies, and loads."""
        f_x, f_y, moment = of_loads
        on_bodies = [mp.fdot(multipliers, rows[:, k]) for k in range(len(q))]
        for k in range(0, len(q), 3):
            x, y, turning = on_bodies[k : k + 3]
            f_x, f_y = f_x - x / self.metre, f_y - y / self.metre
            moment -= turning + q[k] * y - q[k + 1] * x
        return np.array([float(one) for one in (f_x, f_y, moment)])

    def _open(self, moved: Sequence[Series]) -> tuple[list[Any], list[Any]]:
        """M qdd - Q along each coordinate [J per unit of the coordinate]; what loads exert on the ground."""
        gravity = self.file.get("gravity", {"x": 0, "y": 0})
        g_x, g_y = (mp.mpf(gravity[axis]) * self.metre for axis in ("x", "y"))
        frames, found = {"ground": STANDING}, []
        for k, name in enumerate(self.rows.bodies):
            x, y, phi = moved[3 * k : 3 * k + 3]
            s, c = sin_cos(phi)
            (px, vx, _), (py, vy, _) = ((one * self.metre).c for one in (x, y))
            frames[name] = Frame(px, py, c.c[0], s.c[0], phi.c[0], vx, vy, phi.c[1])
        loads = self.loads.exerted(frames, mp.sqrt)
        for k, name in enumerate(self.rows.bodies):
            of = self.file["bodies"][name]
            arm_x, arm_y, x, y = self._center(of, *moved[3 * k : 3 * k + 3])
            mass, inertia = mp.mpf(of.get("mass", 0)), mp.mpf(of.get("inertia", 0))
            f_x, f_y = mass * (2 * x.c[2] - g_x), mass * (2 * y.c[2] - g_y)
            turning = inertia * 2 * moved[3 * k + 2].c[2] + arm_x.c[0] * f_y - arm_y.c[0] * f_x
            on = loads[name]
            found += [(f_x - on[0]) * self.metre, (f_y - on[1]) * self.metre, turning - on[2]]
        return found, loads["ground"]

    def _per(self, u: Sequence[Any]) -> list[Any]:
        """Force or torque of each row, over its multiplier."""
        per: list[Any] = []
        for joint in self.file["joints"].values():
            if joint["type"] == "distance":
                per.append(2 * mp.mpf(joint["length"]) / self.metre)
            else:
                per += [1 if noun == "moment" else 1 / self.metre for noun in NOUNS[joint["type"]]]
        for driver, value in zip(self.file["drivers"].values(), u, strict=True):
            factor = {"angle": 1, "slide": 1 / self.metre}.get(driver["type"])
            per.append(2 * value / self.metre if factor is None else factor)
        return per

    def _inertias(self, square: Any, chosen: Sequence[int], per: Sequence[Any], q: Sequence[Any]) -> Floats:
        """Reduced inertia, from how the coordinates follow each driver: their rates at a speed of 1 in SI units."""
        along = []
        for driver in range(len(self.names), len(per)):
            k = mp.lu_solve(square.T, mp.matrix([per[driver] if row == driver else 0 for row in chosen]))
            parts = []
            for place, name in enumerate(self.rows.bodies):
                of, (x, y, phi) = self.file["bodies"][name], (Series([one, 0]) for one in q[3 * place : 3 * place + 3])
                arm_x, arm_y = (one.c[0] for one in self._center(of, x, y, phi)[:2])
                k_x, k_y, k_phi = k[3 * place] * self.metre, k[3 * place + 1] * self.metre, k[3 * place + 2]
                root = mp.sqrt(mp.mpf(of.get("mass", 0)))
                parts += [root * (k_x - k_phi * arm_y), root * (k_y + k_phi * arm_x)]
                parts.append(mp.sqrt(mp.mpf(of.get("inertia", 0))) * k_phi)
            along.append(parts)
        return np.array([[float(mp.fdot(zip(a, b, strict=True))) for b in along] for a in along])
