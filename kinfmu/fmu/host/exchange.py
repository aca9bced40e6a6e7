"""The exchange of values between the FMUs of a system, at one time: in the order of dependencies, or all at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import groupby

from kinfmu.errors import RequestError, listed
from kinfmu.fmu.host.slaves import LoadedSlave
from kinfmu.fmu.host.structure import Connection
from kinfmu.mechanism.valid import quoted

ORDERED, JACOBI = "ordered", "jacobi"
EXCHANGES = (ORDERED, JACOBI)
Exchange = Callable[[], None]


def check_exchange(kind: str) -> None:
    """Raise a RequestError for an unknown kind of exchange."""
    if kind not in EXCHANGES:
        raise RequestError(f"exchange = {quoted(kind)} must be one of {listed(EXCHANGES)}")


def exchange_of(kind: str, connections: Sequence[Connection], slaves: Mapping[str, LoadedSlave]) -> Exchange:
    """Return a call that passes the values of all connections.

    Args:
        kind: 'ordered': an output is read after the inputs that it depends on are set (the order of Gauss and Seidel);
            'jacobi': all outputs are read before any input is set, so that what passes through an FMU is a step late.
        connections: Connections.
        slaves: Slaves by component.

    """
    if kind == ORDERED:
        found = ordered(connections)[0]
        groups = [list(group) for _, group in groupby(found, key=lambda one: (one.source.name, one.target.name))]
        moves = [(_reader(group, slaves), _writer(group, slaves)) for group in groups]

        def in_order() -> None:
            for read, write in moves:
                write(read())

        return in_order
    pairs = sorted(connections, key=lambda one: (one.source.name, one.target.name))
    groups = [list(group) for _, group in groupby(pairs, key=lambda one: (one.source.name, one.target.name))]
    moves = [(_reader(group, slaves), _writer(group, slaves)) for group in groups]

    def at_once() -> None:
        values = [read() for read, _ in moves]
        for (_, write), row in zip(moves, values, strict=True):
            write(row)

    return at_once


def _reader(group: Sequence[Connection], slaves: Mapping[str, LoadedSlave]) -> Callable[[], list[float]]:
    """Return a call that returns the values for the inputs of connections of one source."""
    get = slaves[group[0].source.name].getter([one.output for one in group])
    if all(one.factor == 1.0 and one.offset == 0.0 for one in group):
        return get
    return lambda: [one.factor * value + one.offset for one, value in zip(group, get(), strict=True)]


def _writer(group: Sequence[Connection], slaves: Mapping[str, LoadedSlave]) -> Callable[[Sequence[float]], None]:
    return slaves[group[0].target.name].setter([one.input for one in group])


def ordered(connections: Sequence[Connection]) -> tuple[list[Connection], list[list[Connection]]]:
    """Return the connections in the order of the dependencies that the FMUs declare, and the algebraic loops.

    In a loop, the first connection of its list passes a value that is a step old.
    """
    before = {
        one: [
            other
            for other in connections
            if other.target is one.source
            and (one.output.dependencies is None or other.input.name in one.output.dependencies)
        ]
        for one in connections
    }
    found: list[Connection] = []
    loops: list[list[Connection]] = []
    path: list[Connection] = []

    def visit(one: Connection) -> None:
        if one in path:
            loops.append([one, *path[path.index(one) + 1 :][::-1]])
        elif one not in found:
            path.append(one)
            for other in before[one]:
                visit(other)
            path.pop()
            found.append(one)

    for one in connections:
        visit(one)
    return found, loops
