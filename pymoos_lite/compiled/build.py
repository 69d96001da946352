"""Compile the hot modules with mypyc and this machine's C compiler.

Run as a script, ``build.py FOLDER``: by the build hook of the package (`hatch_build.py`), where nothing of
the project can be imported, and by ``pymoos compile``. Needs mypy, setuptools and numpy.
"""

from __future__ import annotations

import ast
import json
import os
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

LIBRARY = "pymoos_lite_compiled__mypyc"
OPTIMISE = "1"
"""Dearer levels take twice as long to compile and gained nothing that could be measured."""
NO_FUSED_MULTIPLY = "-ffp-contract=off"
"""Else compilers for some processors round differently than Python does."""
# What the checks of the project ask for is not asked for again. Of other packages numpy's types are needed;
# those of the rest are looked away from, so that the same code comes out whether they are installed or not.
MYPY = """[mypy]
follow_imports = silent
[mypy-numba.*,llvmlite.*,scipy.*,msgpack.*,yaml.*,rich.*,matplotlib.*,distributed.*,pyarrow.*]
follow_imports = skip
ignore_missing_imports = True
"""


def build(folder: Path) -> None:
    """Put the compiled modules and their manifest into `folder`, in place of what was there for this Python.

    Raises:
        ImportError: mypy or setuptools is missing.
        OSError, SystemExit, Exception of setuptools: it could not be compiled; `folder` is as it was before.
    """
    from mypyc.build import mypycify
    from setuptools import Distribution
    from setuptools.command.build_ext import build_ext

    from pymoos_lite.compiled import DOCSTRINGS, MANIFEST, ROOT, SUFFIX, digest, remove, source_of, sources
    from pymoos_lite.compiled.modules import MODULES

    class Parallel(build_ext):
        """All of this machine's processors compile."""

        def build_extensions(self) -> None:
            serial = self.compiler.compile

            def compile(sources: list[str], **options: Any) -> list[str]:
                with ThreadPoolExecutor(os.cpu_count()) as pool:
                    parts = pool.map(lambda source: serial([source], **options), sources)
                    return [each for part in parts for each in part]

            self.compiler.compile = compile
            super().build_extensions()

    files = [source_of(name) for name in MODULES]
    made_from = digest(sources(MODULES))
    with tempfile.TemporaryDirectory() as scratch:
        config = Path(scratch, "mypy.ini")
        config.write_text(MYPY, encoding="utf-8")
        os.chdir(ROOT)
        extensions = mypycify(
            [
                f"--config-file={config}",
                f"--cache-dir={scratch}/cache",
                *(str(s.relative_to(ROOT)) for s in files),
            ],
            opt_level=OPTIMISE,
            debug_level="0",
            multi_file=True,
            group_name=LIBRARY.removesuffix("__mypyc"),
            target_dir=f"{scratch}/c",
        )
        if os.name != "nt":
            for extension in extensions:
                extension.extra_compile_args.append(NO_FUSED_MULTIPLY)
        command = Parallel(Distribution({"name": "pymoos_lite_compiled", "ext_modules": extensions}))
        command.build_temp, command.build_lib = f"{scratch}/objects", f"{scratch}/made"
        command.ensure_finalized()
        command.run()
        made = Path(scratch, "made")
        new = folder.with_name(folder.name + ".new")
        shutil.rmtree(new, ignore_errors=True)
        new.mkdir(parents=True)
        for file in made.rglob("*" + SUFFIX):
            shutil.move(file, new / ".".join(file.relative_to(made).parts))
    docstrings = {name: _docstrings(source) for name, source in zip(MODULES, files, strict=True)}
    (new / DOCSTRINGS).write_text(json.dumps(docstrings, indent=1), encoding="utf-8")
    manifest = {"library": LIBRARY, "modules": list(MODULES), "digest": made_from}
    (new / MANIFEST).write_text(json.dumps(manifest, indent=1), encoding="utf-8")
    folder.mkdir(exist_ok=True)
    remove(folder)
    for file in sorted(new.iterdir(), key=lambda file: file.name == MANIFEST):  # the manifest last
        file.replace(folder / file.name)
    new.rmdir()


def _is_fresh(folder: Path) -> bool:
    from pymoos_lite.compiled import CompiledFinder
    from pymoos_lite.compiled.modules import MODULES

    try:
        finder = CompiledFinder(folder)
    except (OSError, ValueError, KeyError, TypeError):
        return False
    return finder.modules == list(MODULES) and finder.is_fresh


def _docstrings(source: Path) -> dict[str, str]:
    """The docstrings of the classes of a module."""
    body = ast.parse(source.read_text(encoding="utf-8")).body
    return {each.name: ast.get_docstring(each) or "" for each in body if isinstance(each, ast.ClassDef)}


def build_apart(folder: Path) -> str:
    """`build` in a process of its own, unless what is there is fresh; returns "" or why it failed, in one line."""
    command = [sys.executable, __file__, str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode == 0:
        return ""
    lines = [line.strip() for line in (done.stdout + done.stderr).splitlines() if line.strip()]
    telling = [line for line in lines if "error" in line.lower()]
    return (telling or lines or ["it says nothing"])[-1]


if __name__ == "__main__":
    sys.path[0] = str(Path(__file__).parents[2])
    os.environ["PYMOOS_PURE"] = "1"
    target = Path(sys.argv[1]).resolve()
    if not _is_fresh(target):
        build(target)
