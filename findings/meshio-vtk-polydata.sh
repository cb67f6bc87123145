#!/usr/bin/env bash
# meshio 5.3.5 ends the program when it is asked to read a legacy VTK file of POLYDATA.
#
# Expected: POLYDATA is what VTK's own classes, ParaView and most scanners' programs write point clouds
#   and surfaces as; a reader reads it, or raises an error of its own that a program can catch,
#   meshio.ReadError.
# Seen: two lines on standard error, and SystemExit, which "except Exception" does not catch: a program
#   that goes through a folder of scans ends at the first of these files.
# Why it matters: whoever reads what people have must catch SystemExit around meshio, or look at the
#   file's fifth line first.
#
# Fails if meshio comes to read them, or to raise an error.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check meshio==5.3.5 numpy==2.4.6

"$folder/venv/bin/python" - "$folder/triangle.vtk" <<'PYTHON'
import sys

import meshio

with open(sys.argv[1], "w") as file:
    file.write(
        "# vtk DataFile Version 3.0\na triangle\nASCII\nDATASET POLYDATA\n"
        "POINTS 3 float\n0 0 0\n1 0 0\n0 1 0\nPOLYGONS 1 4\n3 0 1 2\n"
    )
try:
    found = meshio.read(sys.argv[1])
except SystemExit as end:
    print(f"meshio {meshio.__version__}: SystemExit({end.code})")
    sys.exit(0)
except Exception as error:
    sys.exit(f"as expected now: {type(error).__name__}")
sys.exit(f"as expected now: {len(found.points)} points were read")
PYTHON
# Only VTK 'UNSTRUCTURED_GRID', 'STRUCTURED_POINTS', 'STRUCTURED_GRID', 'RECTILINEAR_GRID' supported (not POLYDATA).
# Error: Couldn't read file triangle.vtk as vtk
# meshio 5.3.5: SystemExit(1)
