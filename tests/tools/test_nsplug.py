"""The nsplug command line (community.md 2.1): options, files, exit statuses."""

import io

import pytest

from pymoos_lite.tools import cli
from pymoos_lite.tools.nsplug import main


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in").write_text("name = $(V)\nport = $(P=9000)\n")
    return tmp_path


@pytest.mark.parametrize(
    "arguments",
    [
        ["in", "out", "V=abe"],
        ["in", "out", "-f", "V=abe"],
        ["-f", "in", "out", "V=abe"],
        ["V=abe", "--strict", "in", "-l", "out"],
        ["in", "out", "--path=a:b", "V=abe", "-p", "c", "--interactive"],
    ],
)
def test_files_options_and_macros_stand_in_any_order(folder, arguments):
    assert main(arguments) == 0
    assert (folder / "out").read_text() == "name = abe\nport = 9000\n\n"


def test_an_existing_output_is_kept_unless_forced_or_confirmed(folder, monkeypatch):
    (folder / "out").write_text("old")
    monkeypatch.setattr("sys.stdin", io.StringIO("n\n"))
    assert main(["in", "out", "V=1"]) == 0
    assert (folder / "out").read_text() == "old"
    monkeypatch.setattr("sys.stdin", io.StringIO("y\n"))
    assert main(["in", "out", "V=1"]) == 0
    assert (folder / "out").read_text().startswith("name = 1")
    assert main(["in", "out", "V=2", "--force"]) == 0
    assert (folder / "out").read_text().startswith("name = 2")


def test_undefined_macros_warn_and_pass_unless_strict(folder, capsys):
    assert main(["in", "out"]) == 0
    assert (folder / "out").read_text().startswith("name = $(V)")
    assert "in:1" in capsys.readouterr().err
    assert main(["in", "other", "--strict"]) == 1
    assert not (folder / "other").exists()


@pytest.mark.parametrize(
    ("option", "answer", "status"),
    [("-i", "\n", 0), ("-i", "n\n", 1), ("-I", "\n", 1), ("-I", "y\n", 0), ("-i", "", 1)],
)
def test_interactive_asks_about_undefined_macros(folder, monkeypatch, option, answer, status):
    monkeypatch.setattr("sys.stdin", io.StringIO(answer))
    assert main(["in", "out", option]) == status
    assert (folder / "out").exists() == (status == 0)


def test_includes_are_searched_here_and_then_along_the_path(folder):
    for name in ("a", "b"):
        (folder / name).mkdir()
        (folder / name / "plug").write_text(f"{name}\n")
    (folder / "top").write_text("#include plug\n")
    assert main(["top", "out"]) == 1
    assert main(["top", "out", "--path=b:a"]) == 0
    assert (folder / "out").read_text() == "b\n\n"
    (folder / "plug").write_text("here\n")
    assert main(["top", "out", "--path", "b", "-f"]) == 0
    assert (folder / "out").read_text() == "here\n\n"


def test_macro_files_and_the_terminal(folder, capsys):
    (folder / "macros").write_text("# comment\nV = $(W)_1\n")
    assert main(["in", "--terminal", "W=abe", "--macros=macros"]) == 0
    assert capsys.readouterr().out == "name = abe_1\nport = 9000\n\n"


def test_a_bare_word_after_the_files_is_a_macro_without_value(folder):
    (folder / "top").write_text("#ifdef SIM\nsim\n#endif\n#ifdef NONE\nempty\n#endif\n")
    assert main(["top", "out", "SIM", "NONE="]) == 0
    assert (folder / "out").read_text() == "sim\n\n"


def test_xfile_prefers_the_patched_input(folder):
    (folder / "inx").write_text("patched")
    assert main(["in", "out", "-x"]) == 0
    assert (folder / "out").read_text() == "patched\n"


def test_a_tag_selects_a_part(folder):
    (folder / "top").write_text("a\n<tag> x\nb\n")
    assert main(["top", "out", "--tag=x"]) == 0
    assert (folder / "out").read_text() == "b\n\n"


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["in"],
        ["nowhere", "out"],
        ["in", "out", "--nonsense"],
        ["in", "out", "--macros=nowhere"],
        ["in", "out", "=x"],
    ],
)
def test_what_cannot_be_done_exits_with_one_and_one_line(folder, capsys, arguments):
    assert main(arguments) == 1
    assert not (folder / "out").exists()
    assert capsys.readouterr().err.count("\n") <= 1


def test_bytes_that_are_no_utf8_travel_through_unchanged(folder):
    (folder / "raw").write_bytes(b"\xff\xe9 $(V)\r\n")
    assert main(["raw", "out", "V=1"]) == 0
    assert (folder / "out").read_bytes() == b"\xff\xe9 1\n\n"


@pytest.mark.parametrize("option", ["-h", "--help", "-v", "--version", "-m"])
def test_information_exits_with_zero(option, capsys):
    assert main([option]) == 0
    assert capsys.readouterr().out


def test_the_umbrella_command_takes_the_same_words(folder, capsys):
    assert cli.main(["nsplug", "-f", "in", "out", "V=abe", "--strict"]) == 0
    assert (folder / "out").read_text() == "name = abe\nport = 9000\n\n"
    assert cli.main(["nsplug", "--help"]) == 0
    assert "--lenient" in capsys.readouterr().out
    assert cli.main(["nsplug", "in"]) == 1
