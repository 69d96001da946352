"""behaviors.md A6: visual hints."""

import pytest

from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.hints import VisualHints
from pymoos_lite.geometry.specs import SpecError

DEFAULTS = VisualHints({"vertex_size": 3, "edge_color": "white", "label_color": "off"}, prefixes=("nextpt",))


def test_a_prefixed_hint_wins_and_falls_back_on_the_plain_one() -> None:
    hints = DEFAULTS.updated("nextpt_vertex_size=5, nextpt_lcolor=aqua").updated("edge_size = 1")
    assert hints.size("vertex_size", "nextpt") == 5.0
    assert hints.size("vertex_size") == 3.0
    assert hints.size("edge_size", "nextpt") == 1.0
    assert hints.color("label_color", "nextpt") == "aqua"
    assert hints.color("edge_color", "nextpt") == "white"
    assert hints.color("fill_color", default="red") == "red"
    assert DEFAULTS.size("edge_size") is None


def test_hints_become_attributes_of_a_drawing() -> None:
    found = DEFAULTS.updated("nextpt_vertex_color=yellow").attributes("nextpt", Attributes("alpha's nextpt"))
    assert found.tail() == (
        ",label=alpha's nextpt,label_color=invisible,edge_color=white,vertex_color=yellow,vertex_size=3"
    )


@pytest.mark.parametrize("text", ["edge_color=blurple", "vertex_size=-1", "vertex_size=big", "edge_color"])
def test_an_illegal_hint_is_refused_and_changes_nothing(text: str) -> None:
    with pytest.raises(SpecError):
        DEFAULTS.updated("edge_size=9," + text)
    assert DEFAULTS.size("edge_size") is None


def test_hints_nobody_asks_for_are_named() -> None:
    hints = DEFAULTS.updated("nextpt_vertex_size=1, obst_edge_color=red, edge_colors=red")
    assert hints.unknown_keys() == ("edge_colors", "obst_edge_color")
    assert hints == DEFAULTS.updated(hints.to_text())
