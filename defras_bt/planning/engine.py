"""Where rehearsals run: on this machine's cores, or on a Dask cluster."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from joblib import parallel_config

VALID = "local, dask (a cluster started for you on this machine), or dask://HOST:PORT"


class UnknownEngine(ValueError):
    """No engine has that name."""


class EngineUnavailable(RuntimeError):
    """The engine cannot be used here and now."""


@dataclass(frozen=True)
class Engine:
    """``kind`` is local or dask; ``address`` is a Dask scheduler's, None for one of our own.

    ``jobs``: processes side by side; -1 for one per core. A foreign cluster decides itself.
    """

    kind: str = "local"
    address: str | None = None
    jobs: int = -1

    @contextmanager
    def running(self) -> Iterator[int]:
        """joblib's Parallel uses this engine inside the block; gives the ``n_jobs`` to ask for.

        Raises:
            EngineUnavailable: Dask is not installed, or its scheduler does not answer.
        """
        if self.kind == "local":
            with parallel_config(backend="loky", inner_max_num_threads=1):
                yield self.jobs
            return
        with self._cluster() as client, parallel_config(backend="dask"):
            yield -1 if client is not None else self.jobs

    @contextmanager
    def _cluster(self) -> Iterator[Any]:
        try:
            from dask.distributed import Client, LocalCluster
        except ImportError as error:
            raise EngineUnavailable(
                "engine dask: dask.distributed is not installed; `pip install 'defras[dask]'`"
            ) from error
        if self.address is not None:
            try:
                client = Client(self.address, timeout="5s")
            except (OSError, ValueError) as error:
                raise EngineUnavailable(
                    f"engine dask: no Dask scheduler answers at {self.address}: {error}"
                ) from error
            with client:
                yield client
            return
        workers = None if self.jobs < 0 else self.jobs
        with (
            LocalCluster(
                n_workers=workers, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
            ) as cluster,
            Client(cluster) as client,
        ):
            yield client


def engine_named(text: str, jobs: int = -1) -> Engine:
    """The engine that ``--engine`` names.

    Raises:
        UnknownEngine: with what would be valid.
    """
    if text in ("local", "dask"):
        return Engine(text, jobs=jobs)
    host, _, port = text.removeprefix("dask://").rpartition(":")
    if text.startswith("dask://") and host and port.isdecimal():
        return Engine("dask", f"tcp://{host}:{port}", jobs)
    raise UnknownEngine(f"engine {text!r}; valid are {VALID}")
