#!/usr/bin/env python3
"""Checks that the #include lines of src/, shaders/ and tools/ respect the layers of docs/overview.md.

usage: check_layers.py PROJECT_ROOT
Prints one line a violation (file:line: why) and exits with 1 if there is any.
"""
import re
import sys
from pathlib import Path

LAYER = {
    "core": 0, "dialect": 0, "math": 0,
    "mesh": 1, "compute": 1, "kernels": 1, "coop": 1,
    "domain": 2, "quality": 2, "io": 2, "samples": 2, "render": 2,
    "stages": 3,
    "pipeline": 4,
    "capi": 5,
}
# Third-party headers and the only places that may include them.
RESERVED = [
    (re.compile(r"^(vulkan/|vk_video/)"), ("src/compute/vulkan/", "tests/"), "Vulkan"),
    (re.compile(r"^CGAL/"), ("src/domain/", "src/samples/geometry/", "tests/domain/"), "CGAL"),
    (re.compile(r"^[A-Za-z0-9_]+\.hxx$"),
     ("src/io/cad_shape.hpp", "src/io/project_on_cad.cpp", "src/io/read_cad.cpp", "tests/io/"), "OpenCASCADE"),
    (re.compile(r"^vtk[A-Z]"), ("src/io/", "src/render/", "tests/"), "VTK"),
]
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
SOURCES = {".cpp", ".hpp", ".h", ".glsl", ".comp", ".inl"}


def unit_of(path: str):
    """Layer folder that a path relative to src/ or shaders/ belongs to; stages are told apart."""
    parts = path.split("/")
    if parts[0] == "stages" and len(parts) > 2:
        return "stages/" + parts[1]
    return parts[0] if len(parts) > 1 else None


def check_include(relative: str, own: str, target: str, angle: bool):
    for pattern, allowed, name in RESERVED:
        if pattern.match(target) and not relative.startswith(allowed):
            return f"{name} header outside {', '.join(allowed)}"
    if angle or own is None:
        return None
    unit = unit_of(target)
    layer = LAYER.get(unit.split("/")[0]) if unit else None
    if layer is None:
        return None
    own_layer = LAYER[own.split("/")[0]]
    if layer > own_layer:
        return f"{own} (layer {own_layer}) uses {unit} (layer {layer})"
    if own.startswith("stages/") and unit.startswith("stages/") and own != unit:
        return f"one stage uses another: {own} uses {unit}"
    return None


def check_file(root: Path, path: Path):
    relative = path.relative_to(root).as_posix()
    top, _, rest = relative.partition("/")
    own = unit_of(rest) if top in ("src", "shaders") else None
    if own and own.split("/")[0] not in LAYER:
        yield f"{relative}:1: folder '{own}' has no layer; add it to {Path(__file__).name}"
        return
    for number, line in enumerate(path.read_text(errors="replace").splitlines(), 1):
        match = INCLUDE.match(line)
        if not match:
            continue
        complaint = check_include(relative, own, match[2], match[1] == "<")
        if complaint:
            yield f"{relative}:{number}: {complaint}"


def main() -> int:
    root = Path(sys.argv[1]).resolve()
    files = [p for top in ("src", "shaders", "tools", "include", "tests") for p in sorted((root / top).rglob("*"))
             if p.suffix in SOURCES]
    if not files:
        print(f"error: no sources under {root}")
        return 1
    violations = [v for path in files for v in check_file(root, path)]
    print("\n".join(violations) if violations else f"{len(files)} files respect the layers")
    return 1 if violations else 0


if __name__ == "__main__":
    sys.exit(main())
