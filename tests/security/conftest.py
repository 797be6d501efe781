"""Keys of a test's own, and one secured system for all that attack it or end its router."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.security.secured_system import SecuredSystem, secured_system
from touchline.schemas.roles import Role
from touchline.security.authority import CertificateAuthority
from touchline.security.identity import Identity


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "keys"


@pytest.fixture
def authority(folder: Path) -> CertificateAuthority:
    return CertificateAuthority.create(folder)


@pytest.fixture
def anna(authority: CertificateAuthority) -> Identity:
    member = authority.new_member(Role.OPERATOR, "anna")
    authority.issue([member])
    return Identity.load(authority.folder_of(member))


@pytest.fixture(scope="package")
def system(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SecuredSystem]:
    with secured_system(tmp_path_factory.mktemp("secured")) as running:
        yield running
