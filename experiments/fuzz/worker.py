"""What a process that reads damaged files does, and what it may take."""

from __future__ import annotations

import resource
import sys
import tempfile
import traceback
import warnings
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from experiments.fuzz.files import damaged, good_files
from mvreg.errors import InputError
from mvreg.io import NotInPiecesError, PointCloud, open_pieces, read_clouds, whole_scan

#: A file may take so many times its size, and so many bytes besides: as an archive may unpack to a
#: megabyte, and chunks and threads have a room of their own.
TIMES, FLOOR = 10, 256 << 20
#: What reading a file may come to.
FINE = ("points", "refused", "memory refused")
#: Sizes of pieces, far less than the files: as `mvreg.io` has them, by module.
PIECES = {"pieces.BYTES": 600, "pieces.ROWS": 16, "las.CHUNK": 16, "e57.CHUNK": 16,
          "compressed_pieces.WORTH": 0}  # fmt: skip


def outcome(path: Path) -> str:
    """What reading a file comes to: one of `FINE`, or what is wrong."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            clouds = read_clouds(path)
        except InputError as error:
            if str(path) not in str(error):
                return f"error without file: {error}"
            return "memory refused" if "asks for more memory" in str(error) else "refused"
        except Exception:
            return raised()
        good = all(len(cloud.points) and np.isfinite(cloud.points).all() for cloud in clouds)
        if not clouds or not good:
            return "no points, or not finite ones"
        try:
            return "points" if in_pieces(path, clouds) else "other points in pieces"
        except Exception:
            return f"in pieces: {raised()}"


def in_pieces(path: Path, clouds: tuple[PointCloud, ...]) -> bool:
    """Whether a file is the same piece by piece, or is not read so."""
    try:
        parts = [whole_scan(pieces) for pieces in open_pieces(path)]
    except (NotInPiecesError, InputError, OSError, MemoryError):
        return True
    # None at all, or meshes that are sampled when read whole: not read so.
    return not parts or (len(parts) == len(clouds) and all(map(same, parts, clouds)))


def same(one: PointCloud, other: PointCloud) -> bool:
    """Whether two clouds have the same points and attributes."""
    return np.array_equal(one.points, other.points) and all(
        values.dtype == other.attributes[name].dtype
        and np.array_equal(values, other.attributes[name], equal_nan=values.dtype.kind == "f")
        for name, values in one.attributes.items()
    )


def raised() -> str:
    """The exception at hand, and where it is from."""
    last = traceback.extract_tb(sys.exc_info()[2])[-1]
    return f"{sys.exc_info()[1]!r} in {Path(last.filename).name}:{last.lineno}"


def allow(size: int, base: int) -> None:
    """Let this process take as much memory as a file of so many bytes may."""
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (base + FLOOR + TIMES * size, hard))


def taken() -> int:
    """The address space of this process (bytes)."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def small_pieces() -> None:
    """Let small files come in several pieces, too."""
    from importlib import import_module

    for name, size in PIECES.items():
        module, constant = name.split(".")
        setattr(import_module(f"mvreg.io.{module}"), constant, size)


def work(pipe: Connection) -> None:
    """Read the files of (name, seeds), and answer (seed, outcome) before and after each."""
    small_pieces()
    with tempfile.TemporaryDirectory() as folder:
        good = good_files(Path(folder))
        for name, content in good.items():  # libraries are loaded, and their threads there
            path = Path(folder) / f"good-{name}"
            path.write_bytes(content)
            if (found := outcome(path)) != "points":
                raise RuntimeError(f"{name}: {found}")
        base = taken()
        pipe.send((-1, ""))
        while (job := pipe.recv()) is not None:
            name, seeds = job
            path = Path(folder) / f"damaged-{name}"
            for seed in seeds:
                content = damaged(good[name], np.random.default_rng(seed))
                path.write_bytes(content)
                pipe.send((seed, ""))
                allow(len(content), base)
                pipe.send((seed, outcome(path)))
