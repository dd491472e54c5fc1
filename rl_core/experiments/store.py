"""The result store: each result under the digest of what made it, in open formats.

A result is the run of one seed of one arm, in a folder of its own, named by its digest:

    results/<digest>/table.parquet    the tidy table
    results/<digest>/arrays.npz       what was learned, in NumPy's format, without pickle
    results/<digest>/record.json      failures, provenance, and the checksum of every file
    scratch/                          folders being written, each beside a lock of its writer

A result appears whole or not at all: its folder is written in `scratch`, flushed to the disk, and
then renamed. Every byte is under a checksum, so damage is found when a result is read. Several
processes may use one store at once.
"""

import contextlib
import hashlib
import io
import json
import os
import shutil
import uuid
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from filelock import FileLock, Timeout
from numpy.typing import NDArray

from rl_core.kernels.arrays import Arrays
from rl_core.training import Failure, Run

TABLE, ARRAYS, RECORD = "table.parquet", "arrays.npz", "record.json"


class DamagedResultError(Exception):
    """A stored file is not what was written; the message names it."""


@dataclass(frozen=True)
class Store:
    """A folder of results.

    Attributes
    ----------
    path : Path
        Where it is. It is made when the first result is written.

    Examples
    --------
    >>> import numpy as np
    >>> import pandas as pd
    >>> from pathlib import Path
    >>> from rl_core.experiments.store import Store
    >>> from rl_core.training import Run
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     store = Store(Path(folder))
    ...     table = pd.DataFrame({"seed": [7], "episode": [1], "steps": [93]})
    ...     store.write("ab12", Run(table, {"weights": np.zeros((1, 3))}), {"seed": 7})
    ...     (run, provenance), arrays = store.read("ab12"), store.read_arrays("ab12")
    >>> run.table.steps.tolist(), arrays["weights"].shape, provenance
    ([93], (1, 3), {'seed': 7})
    """

    path: Path

    def write(self, digest: str, run: Run, provenance: Mapping[str, Any]) -> None:
        """Store a result under `digest`, atomically: a run, and where it comes from in JSON.

        An intact result that is already there (another process made it) stays; a damaged one is
        replaced.

        Raises
        ------
        TypeError
            An array is neither of numbers nor of truth values.
        """
        table: bytes = run.table.to_parquet(index=False, compression="zstd")
        files = {TABLE: table, ARRAYS: _npz(run.arrays)}
        record = {
            "digest": digest,
            "files": {name: hashlib.sha256(data).hexdigest() for name, data in files.items()},
            "failures": [asdict(failure) for failure in run.failures],
            "provenance": dict(provenance),
        }
        with self.scratch() as folder:
            for name, data in {**files, RECORD: _sealed(record)}.items():
                _write_flushed(folder / name, data)
            _flush(folder)
            self._place(folder, digest)

    def read(self, digest: str) -> tuple[Run, dict[str, Any]]:
        """Return the run under `digest`, without its arrays, and its provenance; all verified.

        Raises
        ------
        KeyError
            There is no such result.
        DamagedResultError
            A file is missing or is not the one that was written.
        """
        record, files = self._verified(digest)
        # In this thread alone: Arrow's may let go of their bytes only when Python shuts down, which
        # aborts the process (https://github.com/apache/arrow/issues/34314).
        parquet = pq.ParquetFile(pa.BufferReader(files[TABLE]), pre_buffer=False)
        table = parquet.read(use_threads=False).to_pandas(use_threads=False)
        failures = tuple(Failure(**failure) for failure in record["failures"])
        return Run(table, failures=failures), record["provenance"]

    def read_arrays(self, digest: str) -> Arrays:
        """Return the arrays of the result under `digest`, bit for bit as they were written.

        Raises
        ------
        KeyError
            There is no such result.
        DamagedResultError
            A file is missing or is not the one that was written.
        """
        _, files = self._verified(digest)
        with np.load(io.BytesIO(files[ARRAYS])) as arrays:
            return dict(arrays)

    def clean(self) -> None:
        """Remove what killed writers left behind."""
        for folder in {path.with_suffix("") for path in (self.path / "scratch").glob("*")}:
            with contextlib.suppress(Timeout, OSError), _lock_of(folder, timeout=0):
                shutil.rmtree(folder, ignore_errors=True)

    @contextlib.contextmanager
    def scratch(self) -> Iterator[Path]:
        """Make an empty folder, locked until the block ends; then remove it, unless it was renamed.

        The lock goes with the process, however that ends, so that `clean` can tell the dead.
        """
        folder = self.path / "scratch" / uuid.uuid4().hex
        folder.parent.mkdir(parents=True, exist_ok=True)
        with _lock_of(folder):
            folder.mkdir()
            try:
                yield folder
            finally:
                shutil.rmtree(folder, ignore_errors=True)

    def _verified(self, digest: str) -> tuple[dict[str, Any], dict[str, bytes]]:
        """Return the record and the files of a result, each checked against its checksum.

        What is parsed later are these very bytes.
        """
        folder = self.path / "results" / digest
        if not folder.exists():
            raise KeyError(f"no result {digest} in the store")
        try:
            record = _unsealed(folder / RECORD)
            files = {name: (folder / name).read_bytes() for name in (TABLE, ARRAYS)}
        except OSError as error:
            raise DamagedResultError(f"{error.filename}: {error.strerror}") from error
        if record["digest"] != digest:
            raise DamagedResultError(f"{folder / RECORD}: tells of the result {record['digest']}")
        for name, data in files.items():
            if hashlib.sha256(data).hexdigest() != record["files"][name]:
                raise DamagedResultError(f"{folder / name}: does not match its checksum")
        return record, files

    def _place(self, folder: Path, digest: str) -> None:
        """Rename a finished folder into `results`, unless an intact result is there."""
        target = self.path / "results" / digest
        target.parent.mkdir(parents=True, exist_ok=True)
        try:
            self._verified(digest)
            return
        except KeyError:
            pass
        except DamagedResultError:  # out of the way at once, unless another process was quicker
            with self.scratch() as away, contextlib.suppress(FileNotFoundError):
                os.rename(target, away / "damaged")
        try:
            os.rename(folder, target)
        except OSError:
            if not target.exists():  # so no other process was quicker
                raise
        _flush(target.parent)


@contextlib.contextmanager
def _lock_of(folder: Path, timeout: float = -1) -> Iterator[None]:
    """Hold the lock beside a folder; it is there for as long as somebody holds it."""
    with FileLock(f"{folder}.lock", timeout=timeout) as lock:
        try:
            yield
        finally:
            with contextlib.suppress(OSError):
                os.unlink(lock.lock_file)


def _npz(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return `arrays` as a file in NumPy's format."""
    for name, array in arrays.items():
        if array.dtype.kind not in "biuf" or not array.dtype.isnative:
            raise TypeError(
                f"array {name!r} has dtype {array.dtype}; allowed are bool, integers and floats in "
                "the machine's byte order"
            )
    sink = io.BytesIO()
    np.savez_compressed(sink, **arrays)  # type: ignore[arg-type]
    return sink.getvalue()


def _sealed(record: Mapping[str, Any]) -> bytes:
    """Return `record` as a JSON file that starts with the record's own checksum."""
    text = json.dumps(record, sort_keys=True, allow_nan=False)
    checksum = hashlib.sha256(text.encode()).hexdigest()
    return json.dumps({"checksum": checksum, "record": record}, sort_keys=True, indent=1).encode()


def _unsealed(path: Path) -> dict[str, Any]:
    """Return the record in a JSON file, if the file is byte for byte the one that was written."""
    data = path.read_bytes()
    try:
        record: dict[str, Any] = json.loads(data)["record"]
        intact = _sealed(record) == data
    except (ValueError, KeyError, TypeError):
        intact = False
    if not intact:
        raise DamagedResultError(f"{path}: does not match its checksum")
    return record


def _write_flushed(path: Path, data: bytes) -> None:
    with path.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


def _flush(folder: Path) -> None:
    """Make the names in `folder` last through a power failure, where the system can do that."""
    if os.name == "posix":
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
