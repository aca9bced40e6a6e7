"""Who made an FMU, and when: attributes of its model description that are stated on request."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime

from kinfmu.errors import RequestError, listed, suggestion
from kinfmu.mechanism.valid import quoted

NAMES = {  # by argument: attribute of FMI
    "author": "author",
    "version": "version",
    "license": "license",
    "copyright": "copyright",
    "date": "generationDateAndTime",
}


def attributes(metadata: Mapping[str, str]) -> dict[str, str]:
    """Return the attributes of fmiModelDescription for metadata.

    Args:
        metadata: Texts by name: author, version, license, copyright, date. A date has the form of ISO 8601, such as
            2026-05-01 or 2026-05-01T12:00:00+02:00; without a zone it is UTC.

    Raises:
        RequestError: A name is unknown, or a text is empty, has several lines, or is no date.

    """
    found = {}
    for name, text in metadata.items():
        if name not in NAMES:
            raise RequestError(f"metadata: '{name}' is not known{suggestion(name, NAMES)}; known: {listed(NAMES)}")
        if not isinstance(text, str) or not text.strip() or not text.isprintable():
            raise RequestError(f"{name} = {quoted(text)} must be one line of text")
        found[NAMES[name]] = _utc(text) if name == "date" else text.strip()
    return found


def _utc(text: str) -> str:
    """Return a date as FMI writes it: YYYY-MM-DDThh:mm:ssZ."""
    try:
        date = datetime.fromisoformat(text.strip())
    except ValueError:
        raise RequestError(f"date = {quoted(text)} must be a date such as 2026-05-01 or 2026-05-01T12:00:00Z") from None
    date = date.replace(tzinfo=UTC) if date.tzinfo is None else date.astimezone(UTC)
    return date.strftime("%Y-%m-%dT%H:%M:%SZ")
