"""Build hook of the package: the hot modules are compiled where that is possible, and left as they are elsewhere.

PYMOOS_COMPILE=0 leaves them as they are in any case; PYMOOS_COMPILE=1 makes it an error when they cannot be compiled.
"""

from __future__ import annotations

import os
import runpy
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CompileHook(BuildHookInterface):
    """Puts the compiled modules beside the packages (editable installs), or into the wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        wanted = os.environ.get("PYMOOS_COMPILE", "")
        if wanted == "0" or self.target_name != "wheel":
            return
        folder = Path(self.root, "pymoos_lite_compiled")
        tool = runpy.run_path(str(Path(self.root, "pymoos_lite", "compiled", "build.py")))
        trouble = tool["build_apart"](folder)
        if trouble:
            if wanted:
                raise RuntimeError(f"the hot modules could not be compiled: {trouble}")
            self.app.display_warning(f"hot modules stay plain Python: {trouble}")
        elif version != "editable":
            build_data["force_include"][str(folder)] = folder.name
            build_data["pure_python"] = False
            build_data["infer_tag"] = True
