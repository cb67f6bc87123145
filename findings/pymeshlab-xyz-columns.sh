#!/usr/bin/env bash
# PyMeshLab 2025.7.post1 reads an XYZ file with an intensity as no points at all, and says nothing.
#
# Expected: x, y, z and a fourth column, as nearly every scanner's program writes XYZ, give the points,
#   with or without the fourth column; or an error.
# Seen: files of 3 and of 6 columns are read; of 4, 5, 7, 8, 9 and 10 columns a mesh without a vertex
#   is loaded, with no error.
# Why it matters: filters then run on nothing, and a pipeline over a folder of scans goes on with
#   empty ones; XYZ with intensity, with colour, and with both have 4, 6 and 7 columns, and a colour
#   is taken for a normal.
#
# Fails if PyMeshLab comes to read or to refuse them.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
  pymeshlab==2025.7.post1 numpy==2.4.6

"$folder/venv/bin/python" - "$folder" <<'PYTHON'
import sys

import numpy as np
import pymeshlab

read = {}
for columns in range(3, 11):
    path = f"{sys.argv[1]}/{columns}.xyz"
    np.savetxt(path, np.arange(50.0 * columns).reshape(50, columns))
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(path)
    read[columns] = meshes.current_mesh().vertex_number()
print(f"PyMeshLab: points read of 50, by columns: {read}")
empty = [columns for columns, count in read.items() if count == 0]
sys.exit(0 if empty == [4, 5, 7, 8, 9, 10] else "as expected now: some of them were read")
PYTHON
# PyMeshLab: points read of 50, by columns: {3: 50, 4: 0, 5: 0, 6: 50, 7: 0, 8: 0, 9: 0, 10: 0}
