"""Which causes are special cases of others, and that both are not named together."""

import pytest
from test_deep_crack import MODEL

from rotorstudy.diagnosis.search.candidates import candidate
from rotorstudy.diagnosis.search.contained import is_contained


def cause(effect, node=1, **shape):
    return candidate(MODEL, effect, {"node": node}, shape, label=effect)


@pytest.mark.parametrize(
    ("inner", "outer", "contained"),
    [
        (cause("support_loss", direction_rad=0.3), cause("bearing_coefficients"), True),
        (cause("support_stiffness"), cause("bearing_coefficients"), True),
        (cause("support_anisotropy"), cause("bearing_coefficients"), True),
        (cause("cross_coupling"), cause("bearing_coefficients"), True),
        (cause("external_damping"), cause("bearing_coefficients"), True),
        (cause("static_preload"), cause("parallel_misalignment"), True),
        (cause("bearing_coefficients"), cause("support_loss", direction_rad=0.3), False),
        (cause("support_loss", direction_rad=0.3), cause("support_stiffness"), False),  # along one direction
        (cause("support_loss", direction_rad=0.3), cause("bearing_coefficients", node=4), False),  # elsewhere
        (cause("static_preload"), cause("angular_misalignment"), False),  # a moment is no force
        (cause("external_damping"), cause("seal", swirl_ratio=0.3), False),  # its fluid turns
        (cause("looseness", lift_m=1e-6), cause("bearing_coefficients"), False),  # a contact
        (cause("unbalance", node=2), cause("added_mass", node=2), False),
    ],
)
def test_a_special_case_is_known_by_its_force(inner, outer, contained):
    assert is_contained(inner, outer) == contained
