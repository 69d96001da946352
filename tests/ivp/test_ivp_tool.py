"""Drawing functions: what `pymoos ivp` reads, what it refuses, and what is in the picture."""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ivp_helm import ivp_tool
from ivp_helm.ivp import Domain, IvPError, IvPFunction, Peak, constant, encode, split_packets, zaic_peak
from ivp_helm.ivp.draw import draw, joint_domain
from ivp_helm.ivp.expressions import parse_functions

HELM = Domain.parse("course,0,359,360:speed,0,4,21:depth,0,100,101")
TEXT = "H,3,1:a,1,2,0,100,D,speed;0;4;21,G,20,F,0,12,10.,13,20,30."


def tool(*arguments: str) -> int:
    parser = argparse.ArgumentParser()
    ivp_tool.add_arguments(parser)
    return ivp_tool.run(parser.parse_args(arguments))


def is_png(path: Path) -> bool:
    return path.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def alog(path: Path) -> Path:
    """A log with two behaviors in iterations 7 and 8, other variables and damage between."""
    lines = ["%% LOG FILE\n", "0.100  IVPHELM_STATE  pHelmIvP  DRIVE\n"]
    for iteration in (7, 8):
        for name, summit in (("waypt", 90.0), ("loiter", 10.0 * iteration)):
            f = zaic_peak(HELM, "course", Peak(summit, basewidth=60)).weighted(100, f"{iteration}:{name}")
            for packet in split_packets(encode(f), f"{name}^{iteration}", 100):
                lines.append(f"{iteration * 2.5:<10.3f} BHV_IPF   pHelmIvP:{name}   {packet}\n")
        lines.append("9.0 BHV_IPF pHelmIvP:x P,broken\n")
        lines.append("9.0 BHV_IPF pHelmIvP:x P,noiteration,1,1,H\n")
    path.write_text("".join(lines))
    return path


class TestTool:
    def test_an_expression_becomes_a_picture(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        out = tmp_path / "rose.png"
        assert (
            tool("100*peak(course, 90, basewidth=60) + 50*leq(speed, 2, 1)", "-o", str(out), "--dpi", "40")
            == 0
        )
        assert is_png(out)
        assert "2 function(s)" in capsys.readouterr().out

    def test_encoded_text_and_files_of_it_are_drawn(self, tmp_path: Path) -> None:
        out = tmp_path / "text.png"
        assert tool(TEXT, "-o", str(out), "--dpi", "40") == 0
        assert is_png(out)
        file = tmp_path / "functions.txt"
        file.write_text(TEXT + "\n\n" + TEXT.replace("1:a", "1:b") + "\n")
        assert tool(str(file), "--sum", "-o", str(out), "--dpi", "40") == 0

    def test_a_log_is_listed_and_drawn(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        log = str(alog(tmp_path / "run.alog"))
        assert tool(log, "--list") == 0
        listing = capsys.readouterr().out.splitlines()
        assert listing[0].endswith("2 helm iterations with functions, 4 message(s) refused")
        assert [line.split() for line in listing[1:]] == [
            ["7", "time", "17.50", "waypt", "loiter"],
            ["8", "time", "20.00", "waypt", "loiter"],
        ]
        out = tmp_path / "log.png"
        assert tool(log, "--time", "17", "--behavior", "loiter", "-o", str(out), "--dpi", "40") == 0
        assert is_png(out)

    def test_the_iteration_is_the_last_the_nearest_or_the_one_asked_for(self, tmp_path: Path) -> None:
        log = ivp_tool.Log(alog(tmp_path / "run.alog").read_text().splitlines())
        assert log.choose(None, None) == 8
        assert log.choose(18.0, None) == 7
        assert log.choose(None, 7) == 7
        assert [f.context for f in log.functions(7, None)] == ["7:loiter", "7:waypt"]
        assert log.functions(8, ["loiter"])[0].evaluate([[80]])[0] == pytest.approx(100, abs=0.1)

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["peek(course, 90)"], "did you mean 'peak'"),
            (["peak(cours, 90)"], "did you mean 'course'"),
            ([TEXT[:-3]], "argument:1: encoded function '1:a'"),
            (
                ["RUN.alog", "--behavior", "waypoint"],
                "no function of behavior 'waypoint'; did you mean 'waypt'",
            ),
            (["RUN.alog", "--iteration", "9"], "there are 7 to 8"),
            (["EMPTY.alog"], "holds no complete BHV_IPF"),
            (["missing.alog"], "missing.alog"),
            ([TEXT, "--dpi", "0"], "--dpi 0"),
            ([TEXT, "-o", "no/such/folder/x.png"], "no/such/folder"),
            ([TEXT, "-d", "speed"], "domain 'speed'"),
        ],
    )
    def test_a_refusal_is_one_line_and_status_one(
        self, arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str],
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:  # fmt: skip
        monkeypatch.chdir(tmp_path)
        alog(tmp_path / "RUN.alog")
        (tmp_path / "EMPTY.alog").write_text("0.1 NAV_X uSim 3\n")
        assert tool(*arguments) == 1
        message = capsys.readouterr().err
        assert words in message
        assert message.count("\n") == 1

    def test_asking_for_help_imports_nothing_heavy(self) -> None:
        code = (
            "import sys, argparse; from ivp_helm import ivp_tool; p = argparse.ArgumentParser();"
            "ivp_tool.add_arguments(p); p.format_help();"
            "print([m for m in ('numba', 'numpy', 'matplotlib') if m in sys.modules])"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert done.stdout.strip() == "[]"


class TestPictures:
    def test_course_and_speed_are_a_rose_with_the_decision_marked(self) -> None:
        f = zaic_peak(HELM, "course", Peak(90, basewidth=60)).weighted(100, "1:waypt")
        g = zaic_peak(HELM, "speed", Peak(2, basewidth=1)).weighted(50, "1:pace")
        figure = draw([f, g], title="two wishes")
        roses = [axes for axes in figure.axes if axes.name == "polar"]
        assert [axes.get_title().split("\n")[0] for axes in roses] == [
            "1:waypt",
            "1:pace",
            "sum of 2 functions",
        ]
        for axes in roses:
            theta, radius = (float(x[-1]) for x in axes.lines[-1].get_data())
            assert (theta, radius) == (pytest.approx(math.pi / 2), pytest.approx(2.0))
        text = figure.get_suptitle()
        assert "two wishes" in text
        assert "course 90, speed 2" in text
        # the mesh holds the weighted sum
        mesh = roses[-1].collections[0].get_array()
        assert float(np.max(mesh)) == pytest.approx(15000)

    def test_one_variable_is_a_curve_and_its_gaps_are_shaded(self) -> None:
        f = IvPFunction(
            HELM.subdomain("depth"), [[0], [60]], [[40], [100]], [[1.0, 0.0], [0.0, 9.0]], weight=1
        )
        figure = draw([f])
        (axes,) = figure.axes
        assert axes.name == "rectilinear"
        curve = np.asarray(axes.lines[0].get_ydata())
        np.testing.assert_allclose(curve[:41], np.arange(41))
        assert len(axes.patches) == 19
        assert "depth 40" in figure.get_suptitle()

    def test_a_third_variable_is_held_at_the_decision(self) -> None:
        f = constant(HELM, 1.0)
        g = zaic_peak(HELM, "depth", Peak(30, basewidth=9)).weighted(1)
        figure = draw([f, g], only_sum=True)
        assert "at depth 30" in figure.axes[0].get_title()

    def test_other_pairs_are_maps(self) -> None:
        domain = Domain.parse("x,0,9,10:y,0,4,5")
        figure = draw([IvPFunction(domain, [[0, 0]], [[9, 4]], [[1.0, -1.0, 0.0]])])
        x, y = (float(v[-1]) for v in figure.axes[0].lines[-1].get_data())
        assert (x, y) == (9.0, 0.0)
        assert figure.axes[0].get_xlabel() == "x"

    def test_a_problem_without_a_decision_is_drawn_and_says_so(self) -> None:
        domain = Domain.parse("x,0,9,10")
        left = IvPFunction(domain, [[0]], [[4]], [[1.0]])
        right = IvPFunction(domain, [[5]], [[9]], [[1.0]])
        assert "no decision (infeasible)" in draw([left, right]).get_suptitle()

    def test_the_picture_domain_puts_course_before_speed(self) -> None:
        parts = [constant(HELM.subdomain(n), 1.0) for n in ("speed", "depth", "course")]
        assert joint_domain(parts).names == ("course", "speed", "depth")
        with pytest.raises(IvPError, match="no functions"):
            joint_domain([])
        with pytest.raises(IvPError, match="panels"):
            draw(parts * 9)


class TestExpressions:
    def test_numbers_set_weights_and_plus_puts_functions_beside_each_other(self) -> None:
        f, g = parse_functions(HELM, "100 * peak(course, 90, 0, 60) + 2.5 * leq('speed', 2, basewidth=1)")
        assert (f.weight, g.weight) == (100.0, 2.5)
        np.testing.assert_array_equal(f.table(), zaic_peak(HELM, "course", Peak(90, 0, 60)).table())

    def test_every_builder_is_there(self) -> None:
        text = (
            "couple(peak(course, 90, basewidth=60, wrap=True), spd(speed, 2, 1, 3, 40, 40), 60, 40)"
            " + hdg(course, 90, 30, 60) + heq(depth, 20, 5) + vector(speed, [0, 2, 4], [0, 100, -10])"
            " + reflect('where(speed > 2, 0, 100 - abs(course - 180) ** 1.5 / pi)', uniform_amount=50)"
        )
        kinds = [":".join(f.domain.names) for f in parse_functions(HELM, text)]
        assert kinds == ["course:speed", "course", "depth", "speed", "course:speed"]

    @pytest.mark.parametrize(
        "text",
        [
            *("", "1", "course", "peak()", "peak(course, 'x')", "peak(course, 1, colour=2)", "peak(*[1])"),
            *("peak(**{})", "__import__('os')", "(lambda: 1)()", "peak.__class__", "[].append", "2 * 3"),
            *("peak(course) * 2", "peak(course", "peak(course, 1, 2, 3, 4, 100, 0)", "couple(peak(course))"),
            *("reflect('__import__(1)')", "reflect('speed.real')", "reflect('height * 2')"),
            *(
                "reflect('sin(speed, 1, 2, 3)')",
                "reflect('1 / (speed - speed)')",
                "vector(speed, ['a'], [1])",
            ),
            *("reflect('speed', uniform_amount='x')", "-" * 5000 + "1", "(" * 3000, "9" * 9999),
            f"peak(course, {'9' * 4000})",
        ],
    )
    def test_what_is_no_expression_is_refused(self, text: str) -> None:
        with pytest.raises(IvPError):
            parse_functions(HELM, text)

    @given(st.text("peakreflectcourse('),*+ 0123456789.=[]-", max_size=40))
    @settings(max_examples=200, deadline=None)
    def test_no_text_does_anything_but_build_or_be_refused(self, text: str) -> None:
        try:
            functions: list[Any] = parse_functions(HELM, text)
        except IvPError:
            return
        assert all(isinstance(f, IvPFunction) for f in functions)
