"""Where a rotor can crack, and the stretches of its shaft that can be softer than stated."""

from collections.abc import Callable
from functools import cached_property

import numpy as np

from rotorstudy.errors import CannotAct, unknown_name

STRETCHES = 8  # most parts into which a shaft is divided, of which longer stretches consist


class CrackPlaces:
    """What a Structure tells about the places of cracks, from these of its fields."""

    dofs: tuple[tuple[int, str], ...]
    nodes: tuple[int, ...]
    stiffness_loss: dict | Callable

    def stiffness_loss_at(
        self, node: int | None = None, element: int | None = None
    ) -> dict[str, tuple[np.ndarray, str, float]]:
        """Stiffness losses of a crack at a place: name -> pattern (dof, dof) of unit 1, unit, typical size.

        CannotAct unless exactly one place is given where there are several, or if the rotor cannot crack there.
        """
        if callable(self.stiffness_loss):
            if (node is None) == (element is None):
                raise CannotAct("this rotor can crack at several places; choose one with 'node:' or 'element:'")
            if node is not None and node not in {n for n, _ in self.dofs}:
                raise unknown_name("node", node, {n for n, _ in self.dofs}, "the crack", CannotAct)
            return self.stiffness_loss(node, element)
        if element is not None or (node is not None and self.nodes != (node,)):
            place = f"node {node}" if element is None else f"element {element}"
            raise CannotAct(
                f"this rotor cannot crack at {place}; it has only one place for a crack, so omit node and element"
            )
        return self.stiffness_loss

    def crack_places(self) -> list[dict]:
        """Options for each possible place of a crack: none for a rotor with one place, else each element."""
        if not callable(self.stiffness_loss):
            return [{}] if self.stiffness_loss else []
        return [{"element": 1 + i} for i in range(self._elements)]

    @cached_property
    def _elements(self) -> int:
        """Number of elements that can crack."""
        for element in range(1, max(node for node, _ in self.dofs) + 1):
            try:
                self.stiffness_loss(None, element)
            except CannotAct:
                return element - 1
        return element

    def stiffness_of(self, element: int, last_element: int | None = None) -> np.ndarray:
        """Stiffness (dof, dof) of an element of the shaft, or of all from it to a last one, N/m (N m of a tilt)."""
        last = element if last_element is None else last_element
        if last < element:
            raise CannotAct(f"last_element {last} lies before element {element}")
        losses = (self.stiffness_loss_at(None, number) for number in range(element, last + 1))
        shares = (pattern for loss in losses for pattern, unit, _ in loss.values() if unit == "1")
        found = next(shares, None)
        if found is None:
            raise CannotAct("this rotor states no stiffness of its elements")
        return sum(shares, found)

    def stretches(self) -> list[dict]:
        """Options of each stretch of elements shorter than the shaft, single ones first; of a fine mesh, of some."""
        numbers = [place["element"] for place in self.crack_places() if place]
        step = max(-(-len(numbers) // STRETCHES), 1)
        starts = numbers[::step]
        ends = [*(start - 1 for start in starts[1:]), *numbers[-1:]]
        longer = [
            {"element": first, "last_element": last}
            for first in starts
            for last in ends
            if 1 < last - first + 1 < len(numbers)
        ]
        return [{"element": number} for number in numbers if len(numbers) > 1] + longer
