"""Numbers as people read them, and the factors of what they write."""

import numpy as np
import pytest

from rotorstudy import RotorstudyError
from rotorstudy.model.shown_units import asked, shown_for
from rotorstudy.units import interval, number, p_value, percent, quantity, spins, um, with_interval


def test_numbers_are_written_with_the_digits_that_are_known():
    assert quantity(1.2345678e-5, "m", 1.04e-7) == "12.35 ± 0.10 µm"
    assert quantity(24980.3, "N/m", 35.8) == "24980 ± 36 N/m"
    assert quantity(0.0300064, "1", 6.8e-5) == "0.030006 ± 0.000068"
    assert quantity(1.184e7, "N/m", 5.4e5) == "1.184e+07 ± 0.054e+07 N/m"
    assert quantity(3.2e-6, "1", 4.1e-7) == "3.20e-06 ± 0.41e-06" and quantity(0.5, "1", 2e-12) == "0.5 ± 2e-12"
    assert quantity(0.6, "1", None) == "0.6" and quantity(5.0, "N", 120.0) == "0 ± 120 N"
    assert quantity(0.5, "rad", np.nan) == "28.6 °" and quantity(2e-3, "s") == "2 ms"


def test_numbers_have_no_exponent_unless_they_are_very_large_or_small():
    plain = [number(x) for x in (1140.4, 760000.0, 3.14159, 2.5e9, np.inf)]
    assert plain == ["1140", "760000", "3.14", "2.5e+09", "inf"]
    assert [number(x) for x in (6.83e-5, 0.00012, 4.2e-9, 0.0)] == ["6.83e-05", "0.00012", "4.2e-09", "0"]
    assert [um(5.55e-5), um(0.0123), quantity(1.23456e-4, "m", digits=4)] == ["56 µm", "12000 µm", "123.5 µm"]


def test_speeds_are_written_in_both_units():
    assert spins([300.0]) == "2865 rpm (300 rad/s)"
    assert spins([300.0, 350.0, 377.0]) == "2865, 3342 and 3600 rpm (300, 350 and 377 rad/s)"
    assert quantity(300.0, "rad/s", 0.5) == "2864.8 ± 4.8 rpm"
    assert spins(np.linspace(100.0, 300.0, 20)) == "20 speeds from 954.9 rpm (100 rad/s) to 2865 rpm (300 rad/s)"


def test_p_values_say_what_they_do_not_resolve():
    assert [p_value(p) for p in (1.0, 0.4, 0.0123, 1e-9)] == ["p = 1", "p = 0.4", "p = 0.012", "p < 1e-6"]
    assert percent(1.234, 2) == "120 %"


def test_an_interval_holds_95_percent():
    assert interval(1.2e-5, "m", 1e-7) == "11.80 to 12.20 µm"
    low, high = (float(end) for end in interval(10.0, "1", 1.0).split(" to "))
    assert (low, high) == pytest.approx((10 - 1.96, 10 + 1.96), abs=0.05)


def test_an_estimate_is_written_with_the_digits_that_are_known():
    assert with_interval(100.23, 4.0, "N/m").strip() == "100.2 ± 4.0 N/m (95 %: 92.4 to 108.1)"
    assert with_interval(4.512e-6, 1.4e-6, "1").strip() == "4.5e-06 ± 1.4e-06 (95 %: 1.8e-06 to 7.3e-06)"
    assert with_interval(23.3, 12.0, "1").strip() == "23 ± 12 (95 %: 0 to 47)"  # -0.2 rounds to zero, without a sign
    assert with_interval(0.5, 0.1, "rad").strip() == "28.6 ± 5.7 ° (95 %: 17.4 to 39.9)"
    assert with_interval(-7.9e-7, 1.9e-7, "m").strip() == "-0.79 ± 0.19 µm (95 %: -1.16 to -0.42)"
    assert with_interval(0.21, 0.0004, "m").strip().startswith("0.21000 ± 0.00040 m")
    assert with_interval(0.5, 1.4, "g mm", least=0.0).strip() == "0.5 ± 1.4 g mm (95 %: 0.0 to 3.2)"
    assert with_interval(0.5, 31.4, "rad") == quantity(0.5, "rad", 31.4) == "any angle"
    assert with_interval(1e7, 2e5, "N/m").strip() == "1.000e+07 ± 0.020e+07 N/m (95 %: 0.961e+07 to 1.039e+07)"


@pytest.mark.parametrize(
    ("words", "length", "unbalance"),
    [(["mil", "oz", "in"], "mil", "oz in"), (["g", "mm"], "um", "g mm"), (["mil"], "mil", "oz in")],
)
def test_units_of_two_words_need_no_quotes_and_an_unbalance_follows_the_length(words, length, unbalance):
    with asked(words), shown_for({}) as shown:
        assert (shown.length, shown.unbalance) == (length, unbalance)
    with asked(words), shown_for({"units": ["g mm"]}) as shown:  # what a rig states stands, unless --units says more
        assert shown.unbalance == (unbalance if "oz" in words else "g mm")
    with pytest.raises(RotorstudyError, match="unknown unit 'oz'"), asked(["oz"]):
        pass
