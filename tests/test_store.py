"""The store gives back the bits it was given, or says which file is damaged."""

import json
import os
import random
import shutil

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import rl_core.experiments.store as store_module
from rl_core.experiments.store import ARRAYS, RECORD, TABLE, DamagedResultError, Store
from rl_core.training import Failure, Run

DIGEST = "0f" * 32
FILES = [TABLE, ARRAYS, RECORD]


def example_table():
    return pd.DataFrame(
        {
            "seed": [5, 5, 5],
            "episode": [1, 2, 3],
            "steps": [10.0, np.nan, -0.0],
            "return": np.array([0.1, np.inf, 1e-310], dtype=np.float64),
            "terminated": [True, False, True],
            "rule": ["greedy", "softmax", "Böltzmann"],
        }
    )


def write_example(store, digest=DIGEST, **changes):
    content = {
        "table": example_table(),
        "arrays": {
            "weights": np.arange(6.0).reshape(2, 3),
            "count": np.int64(7) * np.ones((), int),
        },
        "failures": [Failure(5, 3, "the weights are “NaN”")],
    }
    store.write(digest, Run(**content | changes), {"seed": 5, "config": {"gamma": 0.99}})


@pytest.fixture
def store(tmp_path):
    return Store(tmp_path / "store")


def bits(array):
    return array.dtype, array.shape, array.tobytes()


def test_a_result_comes_back_as_it_was(store):
    write_example(store)
    stored, provenance = store.read(DIGEST)
    pd.testing.assert_frame_equal(stored.table, example_table(), check_exact=True)
    assert np.signbit(stored.table.steps[2])
    assert stored.failures == (Failure(5, 3, "the weights are “NaN”"),)
    assert provenance == {"seed": 5, "config": {"gamma": 0.99}}
    arrays = store.read_arrays(DIGEST)
    assert sorted(arrays) == ["count", "weights"]
    np.testing.assert_array_equal(arrays["weights"], [[0, 1, 2], [3, 4, 5]])
    assert arrays["count"].shape == ()
    assert arrays["count"] == 7


def test_what_is_not_there(store):
    for read in (store.read, store.read_arrays):
        with pytest.raises(KeyError, match=DIGEST):
            read(DIGEST)


DTYPES = ["?", "i1", "u2", "i4", "i8", "u8", "f2", "f4", "f8"]


@settings(max_examples=60, deadline=None)
@given(
    data=st.data(),
    dtype=st.sampled_from(DTYPES),
    shape=hnp.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=5),
)
def test_arrays_keep_every_bit(tmp_path_factory, data, dtype, shape):
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    raw = data.draw(st.binary(min_size=size, max_size=size))
    if dtype == "?":
        raw = bytes(byte & 1 for byte in raw)
    array = np.frombuffer(raw, dtype=dtype).reshape(shape)  # NaNs with payloads and all
    store = Store(tmp_path_factory.mktemp("store"))
    write_example(store, arrays={"a": array, "transposed": array.T})
    back = store.read_arrays(DIGEST)
    assert bits(back["a"]) == bits(array)
    assert bits(back["transposed"]) == bits(array.T)


def test_different_nans_and_zeros_stay_different(store):
    payloads = np.array([0x7FF8000000000001, 0x7FF8000000000002, 0, 1 << 63], dtype=np.uint64)
    write_example(store, arrays={"a": np.tile(payloads.view(np.float64), 500)})
    assert bits(store.read_arrays(DIGEST)["a"]) == bits(np.tile(payloads.view(np.float64), 500))


def test_results_without_rows_or_arrays(store):
    write_example(store, table=example_table().iloc[:0], arrays={}, failures=[])
    stored, _ = store.read(DIGEST)
    pd.testing.assert_frame_equal(stored.table, example_table().iloc[:0])
    assert store.read_arrays(DIGEST) == {}
    assert stored.failures == ()


@pytest.mark.parametrize(
    "array", [np.array([None, 1]), np.array(["a"]), np.zeros(2, complex), np.zeros(2, ">f8")]
)
def test_arrays_of_other_types_are_refused(store, array):
    with pytest.raises(TypeError, match=r"array 'a' has dtype .*; allowed are"):
        write_example(store, arrays={"a": array})
    with pytest.raises(KeyError):
        store.read(DIGEST)


def test_files_are_in_formats_that_others_can_read(store):
    write_example(store)
    folder = store.path / "results" / DIGEST
    assert sorted(os.listdir(folder)) == sorted(FILES)
    assert pd.read_parquet(folder / TABLE).shape == (3, 6)
    assert np.load(folder / ARRAYS)["weights"].tolist() == [[0, 1, 2], [3, 4, 5]]
    assert json.loads((folder / RECORD).read_text())["record"]["provenance"]["seed"] == 5


# --- damage ---------------------------------------------------------------------------------------


def assert_damage_is_named(store, file):
    for read in (store.read, store.read_arrays):
        with pytest.raises(DamagedResultError) as caught:
            read(DIGEST)
        assert str(store.path / "results" / DIGEST / file) in str(caught.value)


@pytest.mark.parametrize("file", FILES)
def test_any_flipped_bit_is_found(store, file):
    write_example(store)
    path = store.path / "results" / DIGEST / file
    intact = path.read_bytes()
    for position in random.Random(file).sample(range(8 * len(intact)), 150):
        damaged = bytearray(intact)
        damaged[position // 8] ^= 1 << position % 8
        path.write_bytes(damaged)
        assert_damage_is_named(store, file)
    path.write_bytes(intact)
    store.read(DIGEST)


@pytest.mark.parametrize("file", FILES)
def test_any_truncation_or_growth_is_found(store, file):
    write_example(store)
    path = store.path / "results" / DIGEST / file
    intact = path.read_bytes()
    for length in [0, 1, len(intact) - 1, *random.Random(file).sample(range(len(intact)), 20)]:
        path.write_bytes(intact[:length])
        assert_damage_is_named(store, file)
    path.write_bytes(intact + b"\n")
    assert_damage_is_named(store, file)
    path.unlink()
    assert_damage_is_named(store, file)


def test_a_valid_result_in_the_wrong_place_is_found(store):
    write_example(store, digest="aa")
    shutil.copytree(store.path / "results" / "aa", store.path / "results" / DIGEST)
    with pytest.raises(DamagedResultError, match="tells of the result aa"):
        store.read(DIGEST)


@pytest.mark.parametrize("file", FILES)
def test_a_damaged_result_is_replaced_and_an_intact_one_kept(store, file):
    write_example(store)
    folder = store.path / "results" / DIGEST
    written = folder.stat().st_ino
    write_example(store)
    assert folder.stat().st_ino == written
    (folder / file).write_bytes(b"")
    write_example(store)
    store.read(DIGEST)
    assert folder.stat().st_ino != written
    assert list((store.path / "scratch").iterdir()) == []


def test_a_file_where_the_folder_should_be_is_replaced(store):
    (store.path / "results").mkdir(parents=True)
    (store.path / "results" / DIGEST).write_text("?")
    with pytest.raises(DamagedResultError):
        store.read(DIGEST)
    write_example(store)
    store.read(DIGEST)


# --- interrupted writing --------------------------------------------------------------------------


@pytest.mark.parametrize("calls", range(5))
def test_an_interrupted_write_leaves_nothing_to_read(store, monkeypatch, calls):
    """Stop at each of the points where something reaches the disk."""
    done = []

    def stop_after(function):
        def stopping(*arguments):
            if len(done) == calls:
                raise KeyboardInterrupt
            done.append(function)
            return function(*arguments)

        return stopping

    with monkeypatch.context() as patch:
        for name in ("_write_flushed", "_flush"):
            patch.setattr(store_module, name, stop_after(getattr(store_module, name)))
        patch.setattr(os, "rename", stop_after(os.rename))
        with pytest.raises(KeyboardInterrupt):
            write_example(store)
    with pytest.raises(KeyError):
        store.read(DIGEST)
    write_example(store)
    store.read(DIGEST)


@pytest.mark.skipif(not os.path.exists("/proc/self/fd"), reason="tells files by Linux's /proc")
def test_everything_is_on_the_disk_before_it_gets_its_name(store, monkeypatch):
    events = []
    fsync, rename = os.fsync, os.rename

    def recorded_fsync(handle):
        events.append(os.path.basename(os.readlink(f"/proc/self/fd/{handle}")))
        fsync(handle)

    def recorded_rename(source, target):
        events.append("rename")
        rename(source, target)

    monkeypatch.setattr(os, "fsync", recorded_fsync)
    monkeypatch.setattr(os, "rename", recorded_rename)
    write_example(store)
    renamed = events.index("rename")
    assert set(FILES) < set(events[:renamed])  # and the scratch folder itself
    assert events[renamed + 1 :] == ["results"]


def test_leftovers_of_the_dead_are_cleaned_and_the_living_are_left_alone(store):
    dead = store.path / "scratch" / "dead"
    dead.mkdir(parents=True)
    (dead / "table.parquet").write_text("half")
    with store.scratch() as living:
        store.clean()
        assert not dead.exists()
        assert living.exists()
    assert not living.exists()
