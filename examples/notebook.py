# %% [markdown]
# # Register scans in a notebook
# Cells begin with `# %%`: editors such as VS Code run them one by one, and
# `jupytext --to notebook examples/notebook.py` makes a notebook of them.

# %%
from pathlib import Path

import numpy as np

import mvreg

# %% [markdown]
# ## Load
# A data set, or `mvreg.dataset("folder", path="my_scans")`, or whatever looks like points:
# `{"front": array, "back": open3d_cloud, "side": data_frame}`.

# %%
scans = mvreg.dataset("tiny")
for scan in scans.scans:
    size = np.ptp(scan.points, axis=0).round(1).tolist()
    print(f"{scan.name}: {len(scan.points):,} points, {size} {scans.unit}")

# %% [markdown]
# ## Register
# `progress` is told how far it is; were its answer False, the registration would end there.


# %%
def tell(now: mvreg.Progress) -> None:
    """Print a line in place of the last one."""
    print(f"\r{now.step} {now.done}/{now.total}: {now.text}".ljust(79), end="")


result = mvreg.register(scans, progress=tell)
print()

# %% [markdown]
# ## How sure is it?
# Without a ground truth: a grade for each pose, green, amber or red, and why.

# %%
assessment = mvreg.assess(result)
for name, about in assessment.scans.items():
    grade = about.grade.value if about.grade else "not graded"
    print(f"{name}: {grade}, confidence {about.confidence:.3f}, covered {about.coverage:.2f}")
print("not placed:", list(result.unregistered) or "none")

# %% [markdown]
# ## All points in one frame
# Rows transform as `points @ R.T + t`.

# %%
merged = np.concatenate([
    scan.points @ result.poses[scan.name][:3, :3].T + result.poses[scan.name][:3, 3]
    for scan in scans.scans if scan.name in result.poses
])  # fmt: skip
print(f"{len(merged):,} points in the frame of {result.reference}")

# %% [markdown]
# ## Draw
# As the last line of a cell, `mvreg.show(result)` is the report, with the scans to turn. It is one
# page that needs no network, and can be kept.

# %%
page = mvreg.show(result, scans)
Path("registration.html").write_text(page.html, encoding="utf-8")
page
