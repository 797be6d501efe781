"""Keys of a test's own."""

from pathlib import Path

import pytest

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
