"""Small machines at few speeds, also with an effect of a test."""

from rotorstudy.blind.machines.cases import draw_case
from rotorstudy.blind.machines.faults import FAMILIES


def small(seed, family, **options):
    """A case of a small rotor at few speeds."""
    return draw_case(seed, family, **({"speeds": 6, "count": 2} | options))


def special(monkeypatch, seed, add, **options):
    """A small case with an effect of a test: add(draw) adds it and returns the truth."""
    monkeypatch.setitem(FAMILIES, "special", add)
    return small(seed, "special", speeds=5, count=2, steps=128, **options)
