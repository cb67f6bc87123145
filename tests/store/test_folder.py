"""The store in a folder: found again, bounded, and never in the way."""

import os
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from mvreg.errors import InputError
from mvreg.store import entries
from mvreg.store.content import digest
from mvreg.store.folder import FolderStore, NoStore, default_folder, open_store, remarks_on

VALUE = (np.arange(1000.0), "text", 3)


def key(number):
    return digest("entry", number)


def test_what_is_kept_is_found_by_another_process(tmp_path):
    FolderStore(tmp_path, 10**9).keep(key(1), VALUE)
    again = FolderStore(tmp_path, 10**9)
    assert digest(again.find(key(1))) == digest(VALUE)
    assert again.find(key(2)) is None
    assert (again.use.found, again.use.kept) == (1, 0)


@pytest.mark.parametrize("damage", ["cut", "bit", "empty", "text", "swapped"])
def test_a_damaged_entry_is_refused_and_made_again(tmp_path, damage):
    store = FolderStore(tmp_path, 10**9)
    store.keep(key(1), VALUE)
    file = store.file(key(1))
    content = bytearray(file.read_bytes())
    if damage == "cut":
        del content[-100:]
    elif damage == "bit":
        content[-50] ^= 1
    elif damage == "empty":
        content.clear()
    elif damage == "text":
        content[:] = b"these are notes\n" * 100
    else:
        store.keep(key(2), (np.zeros(3), "other", 4))
        content[:] = store.file(key(2)).read_bytes()
    file.write_bytes(content)
    assert store.find(key(1)) is None
    assert str(file) in store.use.damaged[0]
    assert "damaged" in " ".join(remarks_on(store))
    store.keep(key(1), VALUE)
    assert digest(store.find(key(1))) == digest(VALUE)


def test_what_was_not_used_for_longest_goes_first(tmp_path):
    store = FolderStore(tmp_path, 40_000)  # an entry takes eight thousand bytes
    for number in range(4):
        store.keep(key(number), VALUE)
        os.utime(store.file(key(number)), (number, number))
    assert store.find(key(0)) is not None  # used now
    for number in range(4, 7):
        store.keep(key(number), VALUE)
    sizes = [size for _, size, _ in store.known()]
    assert sum(sizes) <= 40_000
    assert store.find(key(0)) is not None
    assert store.find(key(1)) is None
    assert store.find(key(6)) is not None


def test_a_folder_that_cannot_be_written_is_no_hindrance(tmp_path, monkeypatch):
    def full(*args):
        raise OSError(28, "No space left on device")

    store = FolderStore(tmp_path, 10**9)
    monkeypatch.setattr(entries, "write", full)
    store.keep(key(1), VALUE)
    monkeypatch.undo()
    store.keep(key(1), VALUE)
    assert not list(tmp_path.rglob("*.safetensors")), "it is not tried again"
    (remark,) = remarks_on(store)
    assert "No space left on device" in remark and str(tmp_path) in remark


def test_an_entry_that_cannot_be_moved_into_place_leaves_nothing(tmp_path):
    file = tmp_path / "entry.safetensors"
    (file / "in the way").mkdir(parents=True)
    with pytest.raises(OSError):
        entries.write(file, key(1), VALUE)
    assert [one.name for one in tmp_path.iterdir()] == [file.name]


def test_what_a_killed_process_left_unfinished_goes_in_time(tmp_path):
    store = FolderStore(tmp_path, 10**9)
    store.keep(key(1), VALUE)
    left = store.file(key(1)).with_suffix(".part")
    left.write_bytes(b"half")
    assert len(list(store.known())) == 1
    assert left.exists(), "somebody may be at it"
    os.utime(left, (time.time() - 7200,) * 2)
    assert len(list(store.known())) == 1
    assert not left.exists()


def test_many_may_write_and_clear_at_once(tmp_path):
    def work(number):
        store = FolderStore(tmp_path, 100_000)
        for k in range(20):
            store.keep(key(k), VALUE)
            found = store.find(key((k * 7 + number) % 20))
            assert found is None or digest(found) == digest(VALUE)
            if number == 0 and k % 7 == 0:
                store.clear()
        return store.use

    with ThreadPoolExecutor(4) as threads:
        uses = list(threads.map(work, range(4)))
    assert not any(use.damaged or use.trouble for use in uses)


def test_clearing_says_what_went(tmp_path):
    store = FolderStore(tmp_path, 10**9)
    store.keep(key(1), VALUE)
    store.keep(key(2), VALUE)
    count, size = store.clear()
    assert count == 2 and size > 16_000
    assert not list(tmp_path.rglob("*.safetensors"))


def test_a_store_is_opened_as_asked(tmp_path, monkeypatch):
    assert isinstance(open_store(False, 1.0), NoStore)
    assert isinstance(open_store(str(tmp_path / "new"), 1.0), FolderStore)
    monkeypatch.setenv("MVREG_STORE", str(tmp_path / "usual"))
    assert default_folder() == tmp_path / "usual"
    with pytest.raises(InputError, match="store_size=0"):
        open_store(True, 0)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="expected a folder"):
        open_store(str(tmp_path / "file"), 1.0)
