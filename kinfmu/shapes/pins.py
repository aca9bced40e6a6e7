"""Where a joint is seen: the points that it names."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import fields

from kinfmu.joints import Revolute
from kinfmu.joints.joint import Joint


def pins_of(joint: Joint, points: Collection[str]) -> list[str]:
    """Points 'body.point' where a joint is drawn; those of a revolute joint coincide."""
    named = [text for text in names_in(joint) if text in points]
    return named[:1] if isinstance(joint, Revolute) else named


def names_in(joint: Joint) -> list[str]:
    """What the text fields of a joint say: points, bodies and choices."""
    found: list[str] = []
    for key in fields(joint):  # type: ignore[arg-type]  # every leaf is a dataclass; the contract cannot say so
        value = getattr(joint, key.name)
        found += [one for one in (value if isinstance(value, tuple) else (value,)) if isinstance(one, str)]
    return found
