"""Checks of an FMU, and the record of them that it carries.

extra/org.kinfmu/conformance.json    checks when it was built, versions, and digests of its other files
extra/org.kinfmu/certificate.json    on request: the proof of its motion, by kinfmu check --certify
"""

from __future__ import annotations

import json
from hashlib import sha256
from pathlib import Path
from textwrap import dedent
from typing import NamedTuple

from kinfmu.errors import FmuError, KinfmuError, listed
from kinfmu.files import temporary_folder
from kinfmu.fmu import description
from kinfmu.fmu.archive import write
from kinfmu.fmu.description import Description
from kinfmu.fmu.documents import completed
from kinfmu.fmu.host.slaves import require_fmpy, slave
from kinfmu.fmu.reference import FOLDER
from kinfmu.fmu.related import MANIFEST
from kinfmu.fmu.unpacked import DESCRIPTION, LARGEST_DESCRIPTION, MECHANISM, text_in, unpacked
from kinfmu.fmu.verify import verify
from kinfmu.mechanism import toml_file

RECORD = f"{FOLDER}/conformance.json"
CERTIFICATE = f"{FOLDER}/certificate.json"
NO_REFERENCE = "no reference results: they depend on the efforts that drive this FMU, and on the steps of the host"
_STEPS = 3  # before the state is saved
_MOST_DIFFERENCES = 3  # that are named


class Check(NamedTuple):
    """A check of an FMU: its name, whether it is passed, and what was found."""

    name: str
    ok: bool
    text: str


def conformance(fmu: str | Path) -> list[Check]:
    """Check an FMU of kinfmu: its files, its description, its states, its reference results and its certificate.

    Args:
        fmu: The FMU.

    Raises:
        FmuError: It is no FMU of kinfmu.
        MissingPackageError: fmpy is not installed.

    """
    path = Path(fmu)
    with unpacked(path) as folder:
        about = description.read(text_in(path, folder, DESCRIPTION, LARGEST_DESCRIPTION).encode(), str(path))
        return [
            _files(path, folder, about),
            *_run(path, folder, about),
            *([_motion(path, folder)] if (folder / CERTIFICATE).exists() else []),
        ]


def record(path: Path, *, certify: bool = False) -> list[Check]:
    """Check an FMU, put the record of it inside, and return the checks; the same FMU gives the same bytes.

    Args:
        path: The FMU.
        certify: True: prove its motion too, and put the proof inside.

    Raises:
        FmuError: It fails a check.
        KinfmuError: Its motion cannot be proved at all.

    """
    more = {}
    with unpacked(path) as folder:
        about = description.read(text_in(path, folder, DESCRIPTION, LARGEST_DESCRIPTION).encode(), str(path))
        files = _digests(folder)  # before it runs: Python may leave its own files in the folder
        checks = _run(path, folder, about)
        if failed := [f"{check.name}: {check.text}" for check in checks if not check.ok]:
            raise FmuError(f"{path}: {failed[0]}")
        if certify:
            from kinfmu.analysis import certify as proved

            certificate = proved(toml_file.parse(text_in(path, folder, MECHANISM), f"{path}: {MECHANISM}"))
            with temporary_folder() as place:
                certificate.write(place / "it.json")
                more[CERTIFICATE] = (place / "it.json").read_bytes()
            checks.append(Check("motion", ok=True, text=dedent(str(certificate)).strip()))
        files |= {name: sha256(data).hexdigest() for name, data in more.items()}
    content = {
        "tool": about.generation_tool,
        "fmi": about.version,
        "token": about.token,
        "checks": {check.name: check.text for check in checks},
        "files": dict(sorted(files.items())),
    }
    more[RECORD] = (json.dumps(content, indent=1) + "\n").encode()
    write(path, completed(path.read_bytes(), more))
    return checks


def _run(path: Path, folder: Path, about: Description) -> list[Check]:
    """Return the checks that need no record."""
    require_fmpy()
    import fmpy
    from fmpy.validation import validate_fmu

    problems = validate_fmu(str(path))
    text = listed(problems) if problems else f"valid by the schemas and rules of fmpy {fmpy.__version__}"
    checks = [Check("description", not problems, text)]
    if "%20" in str(folder) and not (folder / "sources").exists():  # pythonfmu's library does not load there
        return [*checks, Check("state", ok=True, text=f"not stepped: the temporary folder {folder.parent} has %20")]
    checks.append(_state(folder, about))
    if not (folder / f"{FOLDER}/{about.interface.name}_ref.csv").exists():
        text = NO_REFERENCE if about.interface.part("states") else "no reference results"
        return [*checks, Check("results", ok=True, text=text)]
    found = verify(path)
    return [*checks, Check("results", found.ok, str(found))]


def _digests(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of all files, except those that hold digests."""
    names = (file.relative_to(folder).as_posix() for file in folder.rglob("*") if file.is_file())
    return {name: sha256((folder / name).read_bytes()).hexdigest() for name in names if name not in (RECORD, MANIFEST)}


def _files(path: Path, folder: Path, about: Description) -> Check:
    """Compare the files with the record."""
    if not (folder / RECORD).exists():
        return Check("files", ok=True, text="the FMU holds no record of checks")
    try:
        content = json.loads(text_in(path, folder, RECORD))
        recorded, token = dict(content["files"]), str(content["token"])
    except (ValueError, KeyError, TypeError) as error:
        return Check("files", ok=False, text=f"{RECORD} is damaged ({type(error).__name__}: {error})")
    present = _digests(folder)
    changed = sorted(name for name in recorded.keys() | present.keys() if recorded.get(name) != present.get(name))
    if changed:
        rest = "" if len(changed) <= _MOST_DIFFERENCES else f" and {len(changed) - _MOST_DIFFERENCES} others"
        return Check("files", ok=False, text=f"not as they were checked: {listed(changed[:_MOST_DIFFERENCES])}{rest}")
    text = f"{len(present)} files, as {about.generation_tool} checked them; token {token}"
    return Check("files", token == about.token, text)


def _state(folder: Path, about: Description) -> Check:
    """Step, restore the state and step again: all Real outputs have the same bits."""
    experiment = about.interface.experiment
    names = [one.name for one in about.interface if one.causality == "output" and one.type == "Real"]
    messages: list[str] = []
    with slave(about, folder, lambda _, text: messages.append(text)) as loaded:
        loaded.enter(experiment.start)
        loaded.exit()
        t, step = experiment.start, experiment.step
        rows = []
        for _ in range(_STEPS):
            t += step if loaded.step(t, step) else 0.0
        restore = loaded.saved_state()
        if not loaded.step(t, step):
            return Check("state", ok=True, text=f"not stepped: {listed(messages[-1:])}")
        rows.append(loaded.get(names))
        restore()
        loaded.step(t, step)
        rows.append(loaded.get(names))
    is_same = repr(rows[0]) == repr(rows[1])
    text = f"a step from a restored state {'repeats' if is_same else 'differs in'} {len(names)} outputs"
    return Check("state", is_same, f"{text} to the bit" if is_same else text)


def _motion(path: Path, folder: Path) -> Check:
    """Prove the certificate again."""
    from kinfmu.analysis.certified.stored import proved_again
    from kinfmu.mechanism import toml_text

    try:
        certificate = proved_again(folder / CERTIFICATE)
    except KinfmuError as error:
        return Check("motion", ok=False, text=str(error).replace(str(folder / CERTIFICATE), CERTIFICATE))
    own = toml_file.parse(text_in(path, folder, MECHANISM), f"{path}: {MECHANISM}")
    if certificate.mechanism is None or toml_text.text(certificate.mechanism) != toml_text.text(own):
        return Check("motion", ok=False, text=f"{CERTIFICATE} is of another mechanism")
    return Check("motion", ok=True, text=dedent(str(certificate)).strip())
