from ivp_helm.info_buffer import InfoBuffer


def test_the_newest_value_counts_with_its_type():
    buffer = InfoBuffer(10.0)
    buffer.set("N", "abc")
    buffer.set("N", 1.0)
    assert buffer.value("N") == 1.0
    assert buffer.number("N") == 1.0
    buffer.set("N", "7.5")
    assert buffer.value("N") == "7.5"
    assert buffer.number("N") == 7.5


def test_a_number_reads_as_text_and_numeric_text_as_a_number():
    buffer = InfoBuffer()
    buffer.set("A", 2.5)
    buffer.set("B", "not a number")
    assert buffer.text("A") == "2.5"
    assert buffer.number("B") is None
    assert buffer.number("MISSING") is None
    assert buffer.text("MISSING") is None


def test_age_is_exactly_zero_in_the_round_that_brought_the_value():
    buffer = InfoBuffer(100.0)
    buffer.set("A", 1.0, stamp=99.2)
    assert buffer.age("A") == 0.0
    assert buffer.updated("A")
    assert buffer.stamp("A") == 99.2
    buffer.now = 100.25
    assert buffer.age("A") == 0.25
    assert not buffer.updated("A")
    assert buffer.age("B") is None


def test_deltas_hold_every_value_of_the_round_in_order():
    buffer = InfoBuffer()
    for value in ("a", 1.0, "b"):
        buffer.set("U", value)
    assert buffer.deltas("U") == ["a", 1.0, "b"]
    assert buffer.delta_texts("U") == ["a", "b"]
    buffer.clear_deltas()
    assert buffer.deltas("U") == []
    assert buffer.value("U") == "b"


def test_an_assigned_value_is_no_news():
    buffer = InfoBuffer()
    buffer.assign("MODE", "ACTIVE")
    assert buffer.value("MODE") == "ACTIVE"
    assert buffer.deltas("MODE") == []
