#!/usr/bin/env python3
"""The layer check itself: one planted violation of each rule must be found, and nothing else.

usage: test_check_layers.py CHECK_LAYERS.py
"""
import subprocess
import sys
import tempfile
from pathlib import Path

PLANTED = {
    "src/core/up.hpp": '#include "mesh/hex_mesh.hpp"',
    "src/quality/up.cpp": '#include "stages/optimize/optimize.hpp"',
    "src/stages/fit/sideways.cpp": '#include "stages/trim/trim.hpp"',
    "src/pipeline/vulkan.cpp": "#include <vulkan/vulkan.h>",
    "src/mesh/cgal.cpp": "#include <CGAL/Polyhedron_3.h>",
    "tools/hexopt-gpu/vtk.cpp": "# include <vtkCell.h>",
    "src/unknown/folder.cpp": "",
}
SOUND = {
    "src/stages/fit/fit.cpp": '#include "stages/fit/fit.hpp"\n#include "domain/domain.hpp"\n#include <vector>',
    "src/domain/domain.cpp": "#include <CGAL/Polyhedron_3.h>",
    "src/compute/vulkan/device.cpp": "#include <vulkan/vulkan.h>",
}


def main() -> int:
    with tempfile.TemporaryDirectory() as folder:
        for name, text in {**PLANTED, **SOUND}.items():
            path = Path(folder) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text + "\n")
        run = subprocess.run([sys.executable, sys.argv[1], folder], capture_output=True, text=True)
    found = {line.split(":")[0] for line in run.stdout.splitlines()}
    if run.returncode != 1 or found != set(PLANTED):
        print(f"exit {run.returncode}\nmissed: {set(PLANTED) - found}\nwrongly reported: {found - set(PLANTED)}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
