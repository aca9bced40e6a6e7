"""The solver in C, called from here: with the methods of the one in Python, as far as tests need them."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Sequence
from typing import Any, NamedTuple

from kinfmu.codegen.c import compiler, emit
from kinfmu.plan import SolvePlan

STRICT = ("-Wall", "-Wextra", "-Wconversion", "-Werror")
SAME_SINES = "-DKF_LIBRARY_SINCOS"  # those of the C library, which Python has too: all else is compared to the bit
PROBE = """\
#include "internal.h"
size_t probe_solver(void);
size_t probe_state(void);
size_t probe_pose(void);
kf_pose *probe_anchor(kf_solver *solver);
const char *probe_message(const kf_solver *solver);
void probe_tolerance(kf_solver *solver, double tolerance);
void probe_tell(const kf_pose *pose, double *z, double *numbers, int *counts);
bool probe_bind(kf_solver *solver, const double *parameters);
kf_status probe_solve(kf_solver *solver, kf_pose *start, const double *u, kf_pose *pose);
void probe_errors(kf_solver *solver, kf_pose *pose, const double *ud, const double *udd, double errors[3]);
void probe_limit(char *message, const kf_limit *limit, const double *target);
size_t probe_solver(void) { return sizeof(kf_solver); }
size_t probe_state(void) { return KF_SOLVER_STATE; }
size_t probe_pose(void) { return sizeof(kf_pose); }
kf_pose *probe_anchor(kf_solver *solver) { return &solver->anchor; }
const char *probe_message(const kf_solver *solver) { return solver->message; }
void probe_tolerance(kf_solver *solver, double tolerance) { solver->tolerance = tolerance; }
bool probe_bind(kf_solver *solver, const double *parameters) { return kf_solver_bind(solver, parameters); }
kf_status probe_solve(kf_solver *solver, kf_pose *start, const double *u, kf_pose *pose)
{
    return kf_solve(solver, start, u, pose);
}
void probe_errors(kf_solver *solver, kf_pose *pose, const double *ud, const double *udd, double errors[3])
{
    kf_errors(solver, pose, ud, udd, errors);
}
void probe_limit(char *message, const kf_limit *limit, const double *target)
{
    kf_append_limit(message, limit, target, -1);
}
void probe_tell(const kf_pose *pose, double *z, double *numbers, int *counts)
{
    memcpy(z, pose->found.x, KF_UNKNOWNS * sizeof(double));
    numbers[0] = pose->found.margin;
    numbers[1] = pose->found.residual;
    numbers[2] = pose->found.watch;
    counts[0] = (int)pose->status;
    counts[1] = pose->found.iterations;
    counts[2] = pose->bridge;
}
"""


class Answer(NamedTuple):
    """A pose of the solver in C."""

    z: tuple[float, ...]
    margin: float
    residual: float
    watch: float
    status: int
    iterations: int


def numbers(values: Sequence[float]) -> Any:
    return (ctypes.c_double * max(len(values), 1))(*values)


class Native:
    """A solver in C, its committed pose, and the one that was found last."""

    def __init__(self, plan: SolvePlan, flags: Sequence[str] = STRICT) -> None:
        files = emit(plan) | compiler.sources(compiler.SOLVER) | {"probe.c": PROBE}
        self.sizes = {name: int(n) for name, n in re.findall(r"#define KF_(\w+) (\d+)$", files["sizes.h"], re.M)}
        self.c = ctypes.CDLL(str(compiler.shared_library(files, (*flags, SAME_SINES))))
        self.c.probe_anchor.restype = ctypes.c_void_p
        self.c.probe_message.restype = ctypes.c_char_p
        self.c.kf_margin.restype = ctypes.c_double
        self.c.probe_bind.restype = ctypes.c_bool
        self.solver = ctypes.create_string_buffer(self.c.probe_solver())
        self.poses = [ctypes.create_string_buffer(self.c.probe_pose()) for _ in range(2)]
        self.c.kf_solver_start(self.solver)
        self.restart()

    def restart(self) -> None:
        """From the anchor."""
        self.good: Any = ctypes.c_void_p(self.c.probe_anchor(self.solver))
        self.found: Any = self.poses[0]

    def bind(self, values: Sequence[float]) -> str:
        done = self.c.probe_bind(self.solver, numbers(values))
        self.restart()
        assert done == (self.message == "")
        return self.message

    @property
    def message(self) -> str:
        return str(self.c.probe_message(self.solver).decode())

    def solve(self, u: Sequence[float]) -> Answer:
        """A trial from the committed pose."""
        status = self.c.probe_solve(self.solver, self.good, numbers(u), self.found)
        answer = self.answer()
        assert answer.status == status
        return answer

    def take(self, other: Native) -> None:
        """The state of another instance: the solver's first bytes and the committed pose's."""
        state = int(self.c.probe_state())
        ctypes.memmove(self.solver, other.solver, state)
        if isinstance(other.good, ctypes.c_void_p):
            self.restart()
        else:
            self.good, self.found = self.poses
            ctypes.memmove(self.good, other.good, len(self.good))

    def anchor(self) -> Answer:
        return self.answer(ctypes.c_void_p(self.c.probe_anchor(self.solver)))

    def answer(self, pose: Any = None) -> Answer:
        z, three, counts = numbers([0.0] * self.sizes["UNKNOWNS"]), numbers([0.0] * 3), (ctypes.c_int * 3)()
        self.c.probe_tell(self.found if pose is None else pose, z, three, counts)
        return Answer(tuple(z[: self.sizes["UNKNOWNS"]]), *three, *counts[:2])

    def commit(self) -> None:
        self.good, self.found = self.found, self.poses[1] if self.found is self.poses[0] else self.poses[0]

    def motion(self, ud: Sequence[float], udd: Sequence[float], wanted: str = "pva") -> list[list[float] | None]:
        """Positions, rates and accelerations of the pose that was found last."""
        n = self.sizes["OUTPUTS"]
        rows = [numbers([0.0] * n) if letter in wanted else None for letter in "pva"]
        self.c.kf_motion(self.solver, self.found, numbers(ud), numbers(udd), *rows)
        return [None if row is None else list(row[:n]) for row in rows]

    def margin(self) -> float:
        return float(self.c.kf_margin(self.solver, self.found))

    def errors(self, ud: Sequence[float], udd: Sequence[float]) -> tuple[float, ...]:
        three = numbers([0.0] * 3)
        self.c.probe_errors(self.solver, self.found, numbers(ud), numbers(udd), three)
        return tuple(three)
