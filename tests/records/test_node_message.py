"""marine_apps.md 10: NODE_MESSAGE and ACK_MESSAGE."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.records.csp import RecordError
from pymoos_lite.records.node_message import AckMessage, NodeMessage

name = st.text(alphabet="abcDEF09_-", min_size=1, max_size=8)
optional = st.just("") | name
text_value = st.text(alphabet='ab1,=:{}" ', max_size=20) | st.text(max_size=20)

messages = st.builds(
    NodeMessage,
    src_node=name,
    var_name=name,
    value=st.none() | st.integers(-(10**9), 10**9).map(lambda i: i / 10**6) | text_value,
    dest_node=name | st.just("all") | st.lists(name, min_size=2, max_size=3).map(":".join),
    dest_group=optional,
    src_app=optional,
    src_bhv=optional,
    color=optional,
    ack=st.booleans(),
    ack_id=optional,
)


def test_fields_are_printed_in_the_stock_order() -> None:
    message = NodeMessage("abe", "FOO", "bar", "ben", "red", "A", "B", "pink", True, "7")
    assert message.to_text() == (
        "ack_id=7,ack=true,src_node=abe,dest_node=ben,dest_group=red,src_app=A,src_bhv=B,"
        "var_name=FOO,color=pink,string_val=bar"
    )
    assert NodeMessage("abe", "FOO", 3.4, "ben").to_text() == (
        "src_node=abe,dest_node=ben,var_name=FOO,double_val=3.4"
    )


def test_the_helms_off_board_form_is_printed_on_request() -> None:
    message = NodeMessage("abe", "P", "x=1,y=2", "all", src_app="pHelmIvP", src_bhv="wpt")
    assert message.to_text(mark_quoted=True) == (
        'src_node=abe,dest_node=all,src_app=pHelmIvP,src_bhv=wpt,var_name=P,string_val="x=1,y=2",'
        "string_val_quoted=true"
    )
    assert NodeMessage.parse(message.to_text(mark_quoted=True)) == message


def test_quotes_protect_commas_wherever_the_value_stands() -> None:
    message = NodeMessage.parse(
        'SRC_NODE=abe, string_val="x=1,y=2", dest_node=ben:cal, var_name=V, color="red"'
    )
    assert message.value == "x=1,y=2"
    assert message.destinations() == ("ben", "cal")


def test_text_that_looks_numeric_stays_text_and_no_value_is_none() -> None:
    head = "src_node=a,dest_node=b,var_name=V"
    assert NodeMessage.parse(head + ",string_val=12").value == "12"
    assert NodeMessage.parse(head + ",double_val=12").value == 12.0
    assert NodeMessage.parse(head).value is None


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("dest_node=b,var_name=V", "no src_node"),
        ("src_node=a,dest_node=b", "no var_name"),
        ("src_node=a,var_name=V", "neither dest_node nor dest_group"),
        ("src_node=a,dest_node=b,var_name=V,string_val=x,double_val=1", "both"),
        ("src_node=a,dest_node=b,var_name=V,double_val=x", "must be a number"),
        ("hello", "expected key=value"),
        ("", "no src_node"),
    ],
)
def test_an_incomplete_message_is_refused_with_what_is_missing(text: str, reason: str) -> None:
    with pytest.raises(RecordError, match=reason):
        NodeMessage.parse(text)


def test_a_message_names_its_receivers_without_regard_to_case() -> None:
    message = NodeMessage("a", "V", 1.0, "Ben:cal")
    assert message.names("ben")
    assert not message.names("deb")
    assert NodeMessage("a", "V", 1.0, "ALL").names("deb")
    assert NodeMessage("a", "V", 1.0, dest_group="all").is_for_all()
    assert not message.is_for_all()


@given(messages, st.booleans())
def test_any_message_reads_back_from_its_text(message: NodeMessage, mark: bool) -> None:
    assert NodeMessage.parse(message.to_text(mark_quoted=mark)) == message


@given(st.text(alphabet='",={}ab ', max_size=60) | st.text(max_size=60))
def test_hostile_text_gives_a_message_or_a_record_error(text: str) -> None:
    for candidate in (text, "src_node=a,dest_node=b,var_name=c,string_val=" + text):
        try:
            message = NodeMessage.parse(candidate)
        except RecordError:
            continue
        assert NodeMessage.parse(message.to_text()).value == message.value


def test_a_value_full_of_closing_quotes_and_keys_takes_no_time() -> None:
    text = 'src_node=a,dest_node=b,var_name=c,string_val="' + '",color=x' * 100_000
    assert NodeMessage.parse(text).src_node == "a"


def test_an_acknowledgement_reads_back_and_needs_all_three_names() -> None:
    ack = AckMessage("7", "abe", "ben")
    assert ack.to_text() == "id=7, src=abe, dest=ben"
    assert AckMessage.parse(ack.to_text()) == ack
    with pytest.raises(RecordError, match="no dest"):
        AckMessage.parse("id=7,src=abe")
