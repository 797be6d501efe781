"""Schedulers of Dask: with TLS by an identity, and without it only on this machine."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from distributed import LocalCluster, Security

from touchline.cli.workers_choice import WorkersChoice
from touchline.jobs.task_pool import DaskScheduler, on_dask
from touchline.schemas.bus_variables import OPEN_VARIABLE
from touchline.schemas.errors import SpecError, TouchlineError
from touchline.security.authority import CertificateAuthority
from touchline.security.identity import Identity


def times(factor: int, number: int) -> int:
    return factor * number


def lost(number: int, reason: str) -> int:
    raise AssertionError(f"{number}: {reason}")


def made(folder: Path) -> Identity:
    """Return the identity that all machines of a cluster share, of an authority of their own."""
    CertificateAuthority.create(folder)
    return Identity.load(folder / "identities" / "router.main")


@pytest.fixture(scope="module")
def identity(tmp_path_factory: pytest.TempPathFactory) -> Identity:
    return made(tmp_path_factory.mktemp("dask") / "keys")


@pytest.fixture(scope="module")
def address(identity: Identity) -> Iterator[str]:
    files: dict[str, Any] = {"tls_ca_file": str(identity.authority)}
    for who in ("scheduler", "worker", "client"):
        files |= {f"tls_{who}_cert": str(identity.certificate), f"tls_{who}_key": str(identity.key)}
    security = Security(require_encryption=True, **files)
    with LocalCluster(
        n_workers=1, processes=False, dashboard_address="127.0.0.1:0", protocol="tls://", security=security
    ) as cluster:
        yield cluster.scheduler_address


def test_tasks_are_done_by_tls(address: str, identity: Identity) -> None:
    assert address.startswith("tls://127.0.0.1:")
    assert sorted(on_dask(times, 3, [1, 2], DaskScheduler(address, identity), lost)) == [3, 6]


@pytest.mark.parametrize("plain", [False, True])
def test_strangers_are_told_that_no_scheduler_answers(
    address: str, plain: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("touchline.jobs.task_pool._ANSWER_S", 1.0)
    stranger = (
        DaskScheduler(address.replace("tls", "tcp")) if plain else DaskScheduler(address, made(tmp_path / "keys"))
    )
    with pytest.raises(TouchlineError, match=f"no Dask scheduler answers at {stranger.address}"):
        list(on_dask(times, 3, [1], stranger, lost))


def test_schedulers_beyond_this_machine_need_tls_or_leave(monkeypatch: pytest.MonkeyPatch) -> None:
    for address in ("tcp://scheduler:8786", "scheduler:8786", "10.0.0.1:8786", "tcp://[fe80::1]:8786"):
        with pytest.raises(
            SpecError, match=r"--dask is .*, beyond this machine and without TLS; give tls://… and --da"
        ):
            WorkersChoice(dask=address)
    with pytest.raises(SpecError, match="--dask is 'tcp://\\[fe80'; give one like tls://scheduler:8786"):
        WorkersChoice(dask="tcp://[fe80")
    with pytest.raises(SpecError, match="--dask is tcp://a:1; give an address with TLS"):
        WorkersChoice(dask="tcp://a:1", dask_identity="router.main")
    with pytest.raises(SpecError, match="--dask-identity is given without a scheduler; give --dask, too"):
        WorkersChoice(dask_identity="router.main")
    for address in ("tcp://127.0.0.1:8786", "localhost:8786", "tcp://[::1]:8786", "tls://scheduler:8786"):
        WorkersChoice(dask=address)
    monkeypatch.setenv(OPEN_VARIABLE, "1")
    WorkersChoice(dask="tcp://scheduler:8786")
