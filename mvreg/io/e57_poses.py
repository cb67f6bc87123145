"""Write other poses into an E57 file, its points untouched to the bit.

As ASTM E2807 has it: a section of XML, told by the header, describes the scans. Only that section
is written anew, in its place where it fits, else behind all else, and its pages get their
checksums.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from shutil import copyfile
from xml.parsers import expat

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.io.e57_pages import PAGE, PAYLOAD, Pages, logical
from mvreg.types import Array

#: Where the header has the physical length of the file, and the place and length of the XML.
_HEADER = struct.Struct("<8sII4Q")


def rewrite_poses(source: Path, target: Path, poses: Mapping[int, Array]) -> None:
    """Copy a file, and give some of its scans other poses.

    Parameters
    ----------
    source, target : Path
    poses : mapping of int to (4, 4) array
        ``T_world_scan`` by the position of the scan in the file, from 0.

    Raises
    ------
    InputError
        If the file is no E57, or has no such scan.
    """
    length, start, size = _header(source)
    copyfile(source, target)
    with target.open("r+b") as stream:
        pages = Pages(stream.fileno())
        xml = pages.read(logical(start), size)
        changed = with_poses(xml, poses, source)
        if len(changed) <= size:
            pages.write(logical(start), changed.ljust(size))
            return
        first = length // PAGE * PAYLOAD
        pages.write(first, changed.ljust(-(-len(changed) // PAYLOAD) * PAYLOAD))
        whole = length + -(-len(changed) // PAYLOAD) * PAGE
        pages.write(16, struct.pack("<3Q", whole, length, len(changed)))


def positions(path: Path) -> list[int]:
    """The positions of the scans of a file that have points.

    Raises
    ------
    InputError
        If the file is no E57.
    """
    _, start, size = _header(path)
    with path.open("rb") as stream:
        places = _places(Pages(stream.fileno()).read(logical(start), size), path)
    return [index for index, count in enumerate(places.counts) if count]


def with_poses(xml: bytes, poses: Mapping[int, Array], path: Path) -> bytes:
    """The XML with other poses, and nothing else changed.

    Raises
    ------
    InputError
        If it is no XML, or lacks one of the scans.
    """
    places = _places(xml, path)
    missing = [index for index in poses if index >= len(places.scans)]
    if missing:
        raise InputError(f"{path}: expected a scan {missing[0] + 1}, found {len(places.scans)}")
    for index in sorted(poses, reverse=True):
        first, last = places.scans[index]
        xml = xml[:first] + pose_xml(poses[index]) + xml[last:]
    return xml


def _header(path: Path) -> tuple[int, int, int]:
    """Length of the file, place and length of its XML."""
    with path.open("rb") as stream:
        header = stream.read(_HEADER.size)
    if len(header) < _HEADER.size or header[:8] != b"ASTM-E57":
        raise InputError(f"{path}, byte 0: expected an E57 file, got {header[:8]!r}")
    _, _, _, length, start, size, page = _HEADER.unpack(header)
    if page != PAGE or length != path.stat().st_size or length % PAGE or start + size > length:
        raise InputError(f"{path}, byte 16: the header contradicts the file; is it damaged?")
    return length, start, size


def _places(xml: bytes, path: Path) -> _Places:
    found = _Places()
    try:
        found.parse(xml)
    except expat.ExpatError as error:
        raise InputError(f"{path}: its XML section cannot be read: {error}") from error
    return found


def pose_xml(pose: Array) -> bytes:
    """The element of a pose; the quaternion w, x, y, z comes before the translation."""
    x, y, z, w = se3.quaternion(pose[:3, :3])

    def numbers(names: str, values: Iterable[float]) -> str:
        return "".join(
            f'<{name} type="Float">{float(value)!r}</{name}>'
            for name, value in zip(names, values, strict=True)
        )

    return (
        '<pose type="Structure">'
        f'<rotation type="Structure">{numbers("wxyz", (w, x, y, z))}</rotation>'
        f'<translation type="Structure">{numbers("xyz", pose[:3, 3])}</translation></pose>'
    ).encode("ascii")


@dataclass
class _Places:
    """Where the poses of the scans are in the XML; of those that lack one, where it belongs.

    And how many points each scan has.
    """

    scans: list[tuple[int, int]] = field(default_factory=list)
    counts: list[int] = field(default_factory=list)
    path: list[str] = field(default_factory=list)
    begin: int = -1

    SCAN = ("e57Root", "data3D", "vectorChild")

    def parse(self, xml: bytes) -> None:
        """Go through the XML."""
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.end
        self.xml = xml
        # A scan of the standard is <vectorChild> within <data3D>; white space follows the root.
        self.parser.Parse(xml.rstrip(), True)

    def start(self, name: str, attributes: Mapping[str, str]) -> None:
        """An element begins."""
        self.path.append(name)
        if tuple(self.path) == self.SCAN:
            self.counts.append(0)
        if tuple(self.path) == (*self.SCAN, "points"):
            self.counts[-1] = int(attributes.get("recordCount", 0))
        if tuple(self.path) == (*self.SCAN, "pose"):
            self.begin = self.parser.CurrentByteIndex

    def end(self, name: str) -> None:
        """An element ends."""
        at = self.parser.CurrentByteIndex
        if tuple(self.path) == (*self.SCAN, "pose"):
            self.pose = (self.begin, self.xml.index(b">", at) + 1)
        if tuple(self.path) == self.SCAN:
            self.scans.append(self.pose if self.begin >= 0 else (at, at))
            self.begin = -1
        self.path.pop()
