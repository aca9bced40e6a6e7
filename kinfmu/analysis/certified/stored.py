"""Proving the certificate of a file again, cell by cell, without searching."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from kinfmu.analysis.certified.cells import Cells, Prover
from kinfmu.analysis.certified.certificate import FORMAT, Certificate
from kinfmu.analysis.certified.cover import joined
from kinfmu.analysis.certified.formulas import Formulas
from kinfmu.analysis.certified.proving import (
    guess_of,
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
_CLOSE = 1e-12  # of the size; the same for bounds of redundant rows


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
        low, high, tube = (float(states[key] or 0.0) for key in ("low", "high", "tube"))
        gaps = [(float(gap["low"]), float(gap["high"])) for gap in states["not_proved"]]
        rows = {name: float(bound) for name, bound in dict(states.get("redundant_rows", {})).items()}
        centres = [(float(one["low"]), float(one["high"]), one["is_high"]) for one in states["dead_centres"]]
        if not np.isfinite([low, high, tube, *(x for gap in gaps for x in gap)]).all():
            raise ValueError("a number is not finite")
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise KinfmuError(f"{path}: not a complete certificate ({type(error).__name__}: {error})") from None
    plan, box = prepared(mechanism, over, tolerances)
    path_of_driver = follow(plan, 0) if over == "range" else None
    plan = path_of_driver.plan if path_of_driver else plan
    prover = Prover(Formulas(plan, over_time=over == "run", varied=box), box)
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
        poses = {pose.u[0]: pose for pose in path_of_driver.poses}
        guess = guess_of(path_of_driver.solver, poses, lambda u: (u,))
        certificate = of_range(path_of_driver, prover, of_branch(found, poses, guess))
    else:
        solver, poses, values = poses_at(plan, cells.u)
        certificate = of_run(plan, prover, of_branch(found, poses, guess_of(solver, poses, values)))
    certificate = replace(certificate, mechanism=mechanism, tolerances=tolerances)
    near = _SAME * max(abs(certificate.high - certificate.low), 1e-300)
    for gap in certificate.gaps:
        if not any(a - near <= gap.low and gap.high <= b + near for a, b in gaps):
            raise KinfmuError(f"{path}: {gap.low:.9g} to {gap.high:.9g} is not proved: {gap.reason}")
    if certificate.low > low + near or certificate.high < high - near or certificate.turns != states["turns"]:
        raise KinfmuError(f"{path}: its range is not that of the mechanism")
    own = certificate.dead_centres
    for a, b, is_high in centres:
        if not any(a - near <= one.low and one.high <= b + near and one.is_high == is_high for one in own):
            raise KinfmuError(f"{path}: a dead centre that it states is not proved")
    for name, bound in rows.items():
        if not certificate.redundant.get(name, math.inf) <= bound + _CLOSE:
            raise KinfmuError(f"{path}: the redundant row {name} is not proved to close within {bound:.3g}")
    proved = certificate.as_json()
    for key in ("complete", "driver", "mechanism"):
        if states[key] != proved[key]:
            raise KinfmuError(f"{path}: '{key}' is {proved[key]!r}, not {states[key]!r}")
    if tube > certificate.tube * (1.0 + _SAME) or states["share"] > certificate.share + _SAME:
        raise KinfmuError(f"{path}: its tube or its share is not proved")
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
