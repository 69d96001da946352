"""Colour names as viewers know them."""

import pytest

from pymoos_lite.geometry.colors import color_rgb, color_text


@pytest.mark.parametrize(
    "text", ["dodger_blue", "DodgerBlue", "dodgerblue", " gray50 ", "1:0.5:0", "255:128:0"]
)
def test_names_grays_and_triples_are_colours_and_keep_their_spelling(text: str) -> None:
    assert color_text(text) == text.strip()


@pytest.mark.parametrize("text", ["off", "EMPTY", "invisible"])
def test_hidden_colours_are_all_written_invisible(text: str) -> None:
    assert color_text(text) == "invisible"
    assert color_rgb(text) is None


@pytest.mark.parametrize("text", ["", "blurple", "gray101", "gray", "1:2", "1:2:x", "300:0:0", "gray٣"])
def test_other_words_are_no_colours_but_gray_is(text: str) -> None:
    assert color_text(text) == ("gray" if text == "gray" else None)


def test_values_are_fractions_of_full_brightness() -> None:
    assert color_rgb("red") == (1.0, 0.0, 0.0)
    assert color_rgb("gray50") == (0.5, 0.5, 0.5)
    assert color_rgb("255:0:51") == (1.0, 0.0, 0.2)
    assert color_rgb("dodger_blue") == color_rgb("dodgerblue")
