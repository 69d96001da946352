"""The host record of the brokers (native_wire.md 4.2)."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.records.csp import RecordError
from pymoos_lite.records.host_record import HostRecord

SEEN = (
    "community=abe,hostip=127.0.0.1,port_db=19401,port_udp=19411,pshare_iroutes=127.0.0.1:19411,"
    "timewarp=5,time=8976975613.06,key=0"
)


def test_a_string_seen_on_the_wire_is_read_and_written_alike():
    record = HostRecord.parse(SEEN)
    assert record.community == "abe"
    assert record.iroutes == ("127.0.0.1:19411",)
    assert (record.warp, record.key) == (5.0, "0")
    assert record.to_text() == SEEN


def test_an_acknowledgement_carries_status_key_and_id():
    text = (
        "community=shoreside,hostip=127.0.0.1,port_db=19501,port_udp=19511,"
        "pshare_iroutes=127.0.0.1:19511,timewarp=5,status=timewarp (5!=1),key=3,id=64"
    )
    record = HostRecord.parse(text)
    assert (record.status, record.key, record.id) == ("timewarp (5!=1)", "3", "64")
    assert record.to_text() == text


def test_tokens_come_in_any_order_and_case_and_unknown_ones_are_ignored():
    record = HostRecord.parse(
        "PORT_DB=9001, HostIP=localhost, future=x, vname=abe, pshare_iroutes=localhost:9201&multicast_8"
    )
    assert record == HostRecord("abe", "localhost", "9001", "9201", ("localhost:9201", "multicast_8"))


@pytest.mark.parametrize(
    "text",
    [
        "", "community=abe", "community=abe,hostip=localhost", "community=abe,hostip=here,port_db=1",
        "community=abe,hostip=1.2.3,port_db=1", "community=abe,hostip=1.2.3.400,port_db=1",
        "community=abe,hostip=localhost,port_db=x", "community=a b,hostip=localhost,port_db=1", "x" * 5000,
    ],
)  # fmt: skip
def test_what_is_incomplete_is_refused(text):
    with pytest.raises(RecordError, match="host record"):
        HostRecord.parse(text)


def test_localhost_of_another_machine_is_its_address():
    record = HostRecord.parse(
        "community=abe,hostip=10.0.0.7,port_db=1,pshare_iroutes=localhost:9201&multicast_8"
    )
    assert record.routes_from("10.0.0.1") == ("10.0.0.7:9201", "multicast_8")
    assert record.routes_from("10.0.0.7") == ("localhost:9201", "multicast_8")


@given(st.text(max_size=100))
def test_any_text_is_a_record_or_a_record_error(text):
    try:
        record = HostRecord.parse("community=abe,hostip=localhost,port_db=1," + text)
    except RecordError:
        return
    assert HostRecord.parse(record.to_text()).community == record.community
