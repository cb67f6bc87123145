"""Downloads, from a server on this machine: whole or not at all, and nothing outside."""

from __future__ import annotations

import io
import tarfile
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from mvreg.datasets.download import download
from mvreg.errors import InputError


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *args: object) -> None:
        pass


@pytest.fixture
def server(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Path, str]]:
    """A folder, and the address it is served at."""
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    folder = tmp_path / "served"
    folder.mkdir()
    handler = partial(Quiet, directory=str(folder))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as http:
        thread = threading.Thread(target=http.serve_forever, args=(0.01,))
        thread.start()
        yield folder, f"http://127.0.0.1:{http.server_address[1]}/a.tar.gz"
        http.shutdown()
        thread.join()


def pack(path: Path, members: dict[str, bytes | str]) -> None:
    """An archive: bytes become a file, a string a symbolic link to that place."""
    with tarfile.open(path, "w:gz") as archive:
        for name, content in members.items():
            info = tarfile.TarInfo(name)
            if isinstance(content, str):
                info.type, info.linkname = tarfile.SYMTYPE, content
                archive.addfile(info)
            else:
                info.size = len(content)
                archive.addfile(info, io.BytesIO(content))


def everything(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_wanted_files_arrive_and_nothing_else(
    server: tuple[Path, str], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    folder, url = server
    pack(folder / "a.tar.gz", {"x/data/a.ply": b"A" * 100_000, "x/a.conf": b"C", "x/big": b"B"})
    target = tmp_path / "cache" / "set"
    download(url, ["a.ply", "a.conf"], target)
    assert everything(tmp_path / "cache") == {"set/a.ply": b"A" * 100_000, "set/a.conf": b"C"}
    assert "SHA256" not in capfd.readouterr().err


def test_an_incomplete_folder_is_replaced(server: tuple[Path, str], tmp_path: Path) -> None:
    folder, url = server
    pack(folder / "a.tar.gz", {"a.ply": b"new"})
    target = tmp_path / "cache" / "set"
    target.mkdir(parents=True)
    (target / "stale").write_bytes(b"old")
    download(url, ["a.ply"], target)
    assert everything(tmp_path / "cache") == {"set/a.ply": b"new"}


@pytest.mark.parametrize(
    ("members", "message"),
    [
        ({"b.ply": b"B"}, "lacks a.ply"),
        ({"a.ply": "/etc/passwd"}, "lacks a.ply"),
        ({"x/../../a.ply/..": b"B"}, "lacks a.ply"),
    ],
)
def test_what_an_archive_lacks_is_said(
    server: tuple[Path, str], tmp_path: Path, members: dict[str, bytes | str], message: str
) -> None:
    folder, url = server
    pack(folder / "a.tar.gz", members)
    with pytest.raises(InputError, match=message):
        download(url, ["a.ply"], tmp_path / "cache" / "set")
    assert everything(tmp_path / "cache") == {}


def test_paths_in_the_archive_lead_nowhere(server: tuple[Path, str], tmp_path: Path) -> None:
    folder, url = server
    pack(folder / "a.tar.gz", {"../../../a.ply": b"A", "/abs/b.ply": b"B"})
    download(url, ["a.ply", "b.ply"], tmp_path / "cache" / "set")
    assert everything(tmp_path / "cache") == {"set/a.ply": b"A", "set/b.ply": b"B"}
    assert {p.name for p in tmp_path.iterdir()} == {"served", "cache"}


def test_damage_leaves_nothing_behind(server: tuple[Path, str], tmp_path: Path) -> None:
    folder, url = server
    pack(folder / "a.tar.gz", {"a.ply": bytes(range(256)) * 4000})
    whole = (folder / "a.tar.gz").read_bytes()
    changed = bytearray(whole)
    changed[len(whole) // 2] ^= 255
    for content in (b"", b"<html>moved</html>", whole[: len(whole) // 2], bytes(changed)):
        (folder / "a.tar.gz").write_bytes(content)
        with pytest.raises(InputError, match=r"127\.0\.0\.1"):
            download(url, ["a.ply"], tmp_path / "cache" / "set")
        assert list((tmp_path / "cache").iterdir()) == []


def test_no_such_page_and_no_server(server: tuple[Path, str], tmp_path: Path) -> None:
    _, url = server
    with pytest.raises(InputError, match="404"):
        download(url, ["a.ply"], tmp_path / "cache" / "set")
    with pytest.raises(InputError, match="no connection to the server"):
        download("http://127.0.0.1:9/a.tar.gz", ["a.ply"], tmp_path / "cache" / "set")
    assert list((tmp_path / "cache").iterdir()) == []


def test_a_cache_that_cannot_be_written_says_so(server: tuple[Path, str], tmp_path: Path) -> None:
    (tmp_path / "cache").write_text("a file in the way")
    with pytest.raises(InputError, match=r"File exists|Not a directory"):
        download(server[1], ["a.ply"], tmp_path / "cache" / "set")
