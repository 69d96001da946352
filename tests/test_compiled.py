"""Compiled modules: found only as long as they match their sources, and the same to the last bit."""

import ast
import importlib
import inspect
import json
import os
import subprocess
import sys
from importlib.util import module_from_spec

import pytest

from pymoos_lite import compiled
from pymoos_lite.compiled.build import _docstrings
from pymoos_lite.compiled.modules import MODULES
from pymoos_lite.compiled.once import once
from pymoos_lite.geometry.encounter import RelativeState
from pymoos_lite.geometry.polygon import Polygon


def test_the_list_names_each_module_once_in_order():
    assert list(MODULES) == sorted(set(MODULES))
    assert [name for name in MODULES if not compiled.source_of(name).is_file()] == []


@pytest.mark.parametrize("module", MODULES)
def test_no_function_uses_one_name_for_exceptions_of_several_kinds(module):
    # Compiled, the name has the type of the first kind, and catching another raises a TypeError.
    for function in ast.walk(ast.parse(compiled.source_of(module).read_text(encoding="utf-8"))):
        if isinstance(function, ast.FunctionDef):
            kinds: dict[str, set[str]] = {}
            for each in ast.walk(function):
                if isinstance(each, ast.ExceptHandler) and each.name and each.type:
                    kinds.setdefault(each.name, set()).add(ast.unparse(each.type))
            assert [name for name, found in kinds.items() if len(found) > 1] == [], function.name


@pytest.mark.parametrize("module", MODULES)
def test_frozen_dataclasses_stay_plain_classes(module):
    # Compiled ones could be changed, and not copied: a reader of the source would expect neither.
    for each in ast.parse(compiled.source_of(module).read_text(encoding="utf-8")).body:
        if isinstance(each, ast.ClassDef):
            marks = [ast.unparse(mark) for mark in each.decorator_list]
            if any(mark.startswith("dataclass(") and "frozen=True" in mark for mark in marks):
                assert "mypyc_attr(native_class=False)" in marks, each.name


@pytest.mark.parametrize("module", MODULES)
def test_what_is_to_be_kept_is_kept(module):
    # Compiled, functools.cached_property is a plain property: right, and worked out anew at every call.
    names = [
        ast.unparse(mark)
        for mark in ast.walk(ast.parse(compiled.source_of(module).read_text(encoding="utf-8")))
        if isinstance(mark, ast.Name | ast.Attribute)
    ]
    assert [name for name in names if name.endswith("cached_property")] == []


def test_a_property_worked_out_once_is_worked_out_once():
    asked = []

    class Shape:
        @once
        def area(self) -> float:
            """Square metres."""
            asked.append(self)
            return 7.0

    one, other = Shape(), Shape()
    assert (one.area, one.area, other.area) == (7.0, 7.0, 7.0)
    assert asked == [one, other]
    assert inspect.getdoc(Shape.area) == "Square metres."
    with pytest.raises(AttributeError):
        del Shape().area


@pytest.mark.parametrize(
    ("shape", "name"),
    [
        (Polygon.radial(0.0, 0.0, 10.0, 8), "edges"),
        (Polygon.radial(0.0, 0.0, 10.0, 8), "bounds"),
        (RelativeState(0.0, 0.0, 0.0, 1.0, 9.0, 9.0, 0.0, 1.0), "mirror"),
    ],
    ids=["edges", "bounds", "mirror"],
)
def test_shapes_keep_what_they_worked_out(shape, name):
    first = getattr(shape, name)
    assert getattr(shape, name) is first


@pytest.mark.parametrize("module", MODULES)
def test_apps_and_behaviours_can_be_extended(module):
    from ivp_helm.behavior import Behavior
    from pymoos_lite.app import App

    found = importlib.import_module(module)
    for each in ast.parse(compiled.source_of(module).read_text(encoding="utf-8")).body:
        if isinstance(each, ast.ClassDef) and issubclass(getattr(found, each.name), App | Behavior):
            marks = [ast.unparse(mark) for mark in each.decorator_list]
            assert "mypyc_attr(allow_interpreted_subclasses=True)" in marks, each.name


@pytest.fixture
def folder(tmp_path):
    """What a build leaves, of two modules of this project, without the machine code."""
    modules = ["pymoos_lite.core.clock", "pymoos_lite.core.entries"]
    sources = compiled.sources(modules)
    manifest = {"library": "library__mypyc", "modules": modules, "digest": compiled.digest(sources)}
    (tmp_path / compiled.MANIFEST).write_text(json.dumps(manifest))
    return tmp_path


def test_compiled_modules_are_found_by_name_and_others_are_not(folder):
    finder = compiled.CompiledFinder(folder)
    spec = finder.find_spec("pymoos_lite.core.clock")
    assert spec.origin == str(folder / ("pymoos_lite.core.clock" + compiled.SUFFIX))
    assert finder.find_spec("library__mypyc") is not None
    assert finder.find_spec("pymoos_lite.core.message") is None
    with pytest.raises(ImportError):
        module_from_spec(spec)  # there is no such library: nothing else is loaded in its place


def test_one_changed_source_and_none_is_found(folder):
    manifest = json.loads((folder / compiled.MANIFEST).read_text())
    manifest["digest"] = compiled.digest(compiled.sources(["pymoos_lite.core.clock"]))
    (folder / compiled.MANIFEST).write_text(json.dumps(manifest))
    finder = compiled.CompiledFinder(folder)
    assert not finder.is_fresh
    assert finder.find_spec("pymoos_lite.core.clock") is None
    manifest["modules"].append("pymoos_lite.core.is_no_more")
    (folder / compiled.MANIFEST).write_text(json.dumps(manifest))
    assert compiled.CompiledFinder(folder).find_spec("pymoos_lite.core.clock") is None


def test_what_was_built_is_taken_away_and_nothing_else(folder):
    (folder / ("library__mypyc" + compiled.SUFFIX)).write_bytes(b"")
    (folder / "library__mypyc.another-python.so").write_bytes(b"")
    compiled.remove(folder)
    assert [file.name for file in folder.iterdir()] == ["library__mypyc.another-python.so"]
    compiled.remove(folder)
    compiled.remove(folder / "never made")


def test_line_endings_are_no_change(tmp_path):
    unix, windows = tmp_path / "unix.py", tmp_path / "windows.py"
    unix.write_bytes(b"a = 1\nb = 2\n")
    windows.write_bytes(b"a = 1\r\nb = 2\r\n")
    assert compiled.digest([unix]) == compiled.digest([windows])
    assert compiled.digest([unix, unix]) != compiled.digest([unix])


@pytest.mark.parametrize("text", ["", "{", "[]", '{"modules": []}'])
def test_a_broken_manifest_counts_as_none(text, folder, monkeypatch):
    (folder / compiled.MANIFEST).write_text(text)
    monkeypatch.setattr(compiled, "FOLDER", folder)
    monkeypatch.setattr(sys, "meta_path", [])
    monkeypatch.delenv(compiled.SWITCH, raising=False)
    compiled.install()
    assert sys.meta_path == []
    assert compiled.state() == "plain Python (never compiled: pymoos compile)"


def test_the_state_says_what_runs(folder, monkeypatch):
    monkeypatch.setattr(compiled, "FOLDER", folder)
    monkeypatch.setattr(sys, "meta_path", [])
    monkeypatch.setenv(compiled.SWITCH, "1")
    compiled.install()
    assert sys.meta_path == []
    assert compiled.state() == "plain Python (PYMOOS_PURE is set)"
    monkeypatch.setenv(compiled.SWITCH, "0")
    compiled.install()
    compiled.install()
    assert len(sys.meta_path) == 1
    assert compiled.state() == "compiled"
    monkeypatch.setattr(sys.meta_path[0], "_fresh", False)
    assert compiled.state() == "plain Python (a source has changed since: pymoos compile)"


@pytest.mark.parametrize("first", ["ivp_helm.helm", "ivp_helm.app", "missions.bloom.control_app"])
def test_classes_keep_their_docstrings_whoever_loads_them(first):
    words = f"import {first}, ivp_helm.helm; print(ivp_helm.helm.HelmCore.__doc__)"
    printed = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, check=True).stdout
    assert printed.split() == _docstrings(compiled.source_of("ivp_helm.helm"))["HelmCore"].split() != []


def test_all_classes_of_all_modules_keep_their_docstrings():
    for module in MODULES:
        found = importlib.import_module(module)
        for name, text in _docstrings(compiled.source_of(module)).items():
            if text:  # a dataclass without one makes its own
                assert (inspect.getdoc(getattr(found, name)) or "").split() == text.split(), (module, name)


@pytest.mark.slow
@pytest.mark.parametrize(
    "mission",
    [("berta", "--vehicles", "3"), ("bloom", "--vehicles", "3", "--preset", "paper"), ("alpha",)],
    ids=lambda words: words[0],
)
def test_logs_are_the_same_byte_for_byte_compiled_and_plain(mission, tmp_path):
    def logs(name, pure):
        out = tmp_path / name
        words = ["sim", *mission, "--duration", "120", "--seed", "3", "--log-dir", str(out)]
        subprocess.run(
            [sys.executable, "-m", "pymoos_lite.tools.cli", *words],
            env={**os.environ, compiled.SWITCH: pure},
            check=True,
            capture_output=True,
            timeout=300,
        )
        return {str(file.relative_to(out)): file.read_bytes() for file in sorted(out.rglob("*.alog"))}

    plain = logs("plain", "1")
    assert sum(map(len, plain.values())) > 10_000
    assert logs("compiled", "") == plain
