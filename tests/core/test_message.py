"""Message and value conversion."""

import numpy as np
import pytest

from pymoos_lite.core.message import Message, as_value


@pytest.mark.parametrize(
    ("given", "stored"),
    [
        (3, 3.0),
        (True, "true"),
        (False, "false"),
        (np.float32(0.5), 0.5),
        (np.int64(7), 7.0),
        (np.bool_(True), "true"),
        (np.str_("x"), "x"),
        (bytearray(b"ab"), b"ab"),
        ("text", "text"),
    ],
)
def test_notify_values_become_double_string_or_binary(given, stored):
    value = as_value(given)
    assert value == stored
    assert type(value) is type(stored)


@pytest.mark.parametrize("given", [None, [1.0], {"a": 1}, object()])
def test_other_values_are_refused(given):
    with pytest.raises(TypeError, match="number, text or bytes"):
        as_value(given)


def test_a_message_reads_as_number_text_and_origin():
    double = Message("NAV_X", 2.5, 10.0, "sim")
    text = Message("N", "12.5", 10.0, "helm", aux="4:waypt")
    assert (double.kind, double.number, double.text, double.origin) == ("D", 2.5, "2.5", "sim")
    assert (text.kind, text.number, text.origin) == ("S", 12.5, "helm:4:waypt")
    assert Message("B", b"xyz", 0.0, "a").number is None
