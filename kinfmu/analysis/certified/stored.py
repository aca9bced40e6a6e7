"""Proving the certificate of a file again, cell by cell, without searching."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from kinfmu.analysis.certified.cells import Cells, Prover
from kinfmu.analysis.certified.certificate import FORMAT, Certificate
from kinfmu.analysis.certified.cover import joined
from kinfmu.analysis.certified.proving import (
    formulas_of,
    of_branch,
    of_range,
    of_run,
    poses_at,
    prepared,
)
from kinfmu.analysis.driver_path import follow
from kinfmu.errors import KinfmuError
from kinfmu.mechanism.toml_file import parse

_LARGEST = 500_000_000  # [bytes]
_SAME = 1e-9  # of the range; what is proved again may differ by rounding of other versions


def proved_again(path: str | Path) -> Certificate:
    """Return the certificate of a file, proved anew: every cell by one test, the joints between cells, the ends.

    Args:
        path: The file, written by `Certificate.write`.

    Raises:
        KinfmuError: It is no such file; or something that it states is not proved.

    """
    content = _content(Path(path))
    try:
        mechanism, over, tolerances = parse(content["mechanism"], str(path)), content["over"], content["tolerances"]
        arrays = {name: np.array(content["cells"][name], dtype=float) for name in ("low", "high", "u", "path", "radii")}
        states = content["states"]
        low, high, gaps = states["low"], states["high"], [(gap["low"], gap["high"]) for gap in states["not_proved"]]
        centres, turns = len(states["dead_centres"]), states["turns"]
    except (KeyError, TypeError, ValueError) as error:
        raise KinfmuError(f"{path}: not a complete certificate ({type(error).__name__}: {error})") from None
    plan, box = prepared(mechanism, over, tolerances)
    path_of_driver = follow(plan, 0) if over == "range" else None
    plan = path_of_driver.plan if path_of_driver else plan
    prover = Prover(formulas_of(plan, over_time=over == "run", varied=box), box)
    count, n = len(arrays["u"]), len(prover.formulas.unknowns)
    shapes = {"low": (count,), "high": (count,), "u": (count,), "path": (3, n, count)}
    shapes["radii"] = (len(prover.formulas.blocks), count)
    for name, shape in shapes.items():
        if arrays[name].size != np.prod(shape) or not np.isfinite(arrays[name]).all():
            raise KinfmuError(f"{path}: cells.{name} must be {' x '.join(map(str, shape))} finite numbers")
        arrays[name] = arrays[name].reshape(shape)
    radii = arrays.pop("radii")
    cells = Cells(**arrays)
    if not ((cells.low <= cells.u) & (cells.u <= cells.high)).all():
        raise KinfmuError(f"{path}: a cell does not hold its centre")
    tubes = prover.prove(cells, radii)
    if not tubes.is_proved.all():
        k = int(np.argmin(tubes.is_proved))
        raise KinfmuError(f"{path}: the cell from {cells.low[k]:.9g} to {cells.high[k]:.9g} is not proved")
    found = joined([(cells, tubes)])
    if path_of_driver:
        certificate = of_range(path_of_driver, prover, of_branch(found, {p.u[0]: p for p in path_of_driver.poses}))
    else:
        certificate = of_run(plan, prover, of_branch(found, poses_at(plan, cells.u)[1]))
    near = _SAME * max(abs(high - low), 1e-300)
    for gap in certificate.gaps:
        if not any(a - near <= gap.low and gap.high <= b + near for a, b in gaps):
            raise KinfmuError(f"{path}: {gap.low:.9g} to {gap.high:.9g} is not proved: {gap.reason}")
    if certificate.low > low + near or certificate.high < high - near or certificate.turns != turns:
        raise KinfmuError(f"{path}: its range is not that of the mechanism")
    if len(certificate.dead_centres) < centres:
        raise KinfmuError(f"{path}: a dead centre that it states is not proved")
    return certificate


def _content(path: Path) -> dict[str, Any]:
    """Return what the file holds."""
    try:
        if path.stat().st_size > _LARGEST:
            raise KinfmuError(f"{path}: too large for a certificate (largest: {_LARGEST} bytes)")
        content = json.loads(path.read_bytes())
    except OSError as error:
        raise KinfmuError(f"{path}: cannot be read ({error.strerror})") from None
    except (ValueError, RecursionError):
        raise KinfmuError(f"{path}: not a certificate of kinfmu (not JSON)") from None
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise KinfmuError(f"{path}: not a certificate of kinfmu; its format is '{FORMAT}'")
    return content
