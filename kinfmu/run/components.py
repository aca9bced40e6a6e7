"""What the info of a run states of the mechanisms in a system of several FMUs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

MAIN = "mechanism of"  # the component whose mechanism the run holds, if there are others
_OTHER = f"{MAIN} "  # and then its name: the mechanism file of another component


def mechanism_info(main: str, others: Sequence[tuple[str, str]]) -> dict[str, str]:
    """Return what the info of a run states of the mechanisms in a system; nothing if there is only one.

    main: The component whose mechanism the run holds. others: Other components with the texts of their mechanism files.
    """
    return {MAIN: main} | {f"{_OTHER}{name}": text for name, text in others} if others else {}


def is_of_mechanisms(key: str) -> bool:
    """Return whether a key of a run's info is one of `mechanism_info`."""
    return key == MAIN or key.startswith(_OTHER)


def other_mechanisms(info: Mapping[str, str]) -> dict[str, str]:
    """Return the mechanism files of the other components by name."""
    return {key.removeprefix(_OTHER): text for key, text in info.items() if key.startswith(_OTHER)}
