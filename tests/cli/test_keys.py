"""`touchline keys`, as its user sees it."""

import shutil
from datetime import timedelta

import pytest

from touchline.security import certificates
from touchline.security.identity import Identity


@pytest.fixture
def keys(touchline, tmp_path, monkeypatch):
    """`touchline keys`, with an authority in the user's own folder."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    code, out, said = touchline("keys", "init", "--router", "tls/192.0.2.1:7461")
    assert (code, out) == (0, "") and f"in {tmp_path}/touchline/keys\n" in said
    return lambda *arguments: touchline("keys", *arguments)


def test_from_nothing_to_a_revoked_identity(keys, tmp_path, monkeypatch):
    identities = tmp_path / "touchline" / "keys" / "identities"
    code, out, said = keys("issue", "robot", "field/tt2", "--host", "192.0.2.3", "--host", "tt2.local")
    assert (code, out) == (0, f"{identities}/robot.field.tt2\n")
    to_robot, to_router = said.splitlines()
    assert to_robot == f"copy {identities}/robot.field.tt2 to 192.0.2.3"
    path = identities / "router.main" / "access.json"
    assert to_router == f" warning 192.0.2.1 has an older access list: copy {path} to the folder router.main"
    assert keys("issue", "operator", "anna", "--days", "90")[0] == 0
    later = certificates.now() + timedelta(days=28)
    monkeypatch.setattr(certificates, "now", lambda: later)
    code, out, _ = keys("list")
    title, _, *rows = out.splitlines()
    assert code == 0 and title.endswith("; access list 4") and title.startswith("certificate authority ")
    assert [row.split("\t")[:3] for row in rows] == [
        ["router.main", "router", "192.0.2.1"],
        ["robot.field.tt2", "robot", "192.0.2.3, tt2.local"],
        ["operator.anna", "operator", "localhost, 127.0.0.1, ::1"],
    ]
    assert rows[0].endswith("(in 48 h)") and rows[2].endswith("(in 62 days)")
    code, out, said = keys("renew")
    assert (code, out) == (0, f"{identities}/router.main\n{identities}/robot.field.tt2\n")
    assert f"copy {identities}/robot.field.tt2 to 192.0.2.3\n" in said
    assert keys("renew") == (0, "", "nothing expires soon\n")
    shutil.copy(identities / "router.main" / "access.json", tmp_path / "older.json")
    code, out, said = keys("revoke", "operator.anna")
    assert (code, out) == (0, "") and "192.0.2.1 has an older access list" in said and "192.0.2.3 has an older" in said
    shutil.copy(tmp_path / "older.json", identities / "router.main" / "access.json")  # as if it had been interrupted
    assert "revoked already" in keys("revoke", "operator.anna")[2]
    assert Identity.load(identities / "router.main").access.revoked == ("operator.anna",)
    assert keys("list")[1].splitlines()[-1] == "operator.anna\toperator\t\trevoked"


def test_the_list_shows_what_is_not_as_it_should_be(keys, tmp_path, monkeypatch):
    identities = tmp_path / "touchline" / "keys" / "identities"
    for name in ("anna", "bert"):
        keys("issue", "operator", name)
    (identities / "router.main" / "certificate.pem").write_text("nonsense")
    shutil.rmtree(identities / "operator.anna")
    later = certificates.now() + timedelta(days=31)
    monkeypatch.setattr(certificates, "now", lambda: later)
    code, out, _ = keys("list")
    ends = [row.split("\t")[3] for row in out.splitlines()[2:]]
    assert code == 0 and ends[0] == "certificate.pem is not a certificate (PEM)"
    assert ends[1] == "not in this folder" and ends[2].endswith("(expired)")


def test_errors_are_a_line_with_a_remedy(keys, touchline, tmp_path):
    for arguments, says in (
        (("init",), "is there already; use it, or, for another router, move "),
        (("issue", "operator", "a b"), "NAME is 'a b'; use letters, digits, _ and -"),
        (("renew", "operator.ana"), "NAME 'operator.ana' is no member; did you mean 'operator.anna'?"),
        (("revoke", "router.main"), "router.main cannot be revoked: it is the router that heeds the access list"),
        (("list", "--folder", str(tmp_path / "none")), "holds no certificate authority; make one: touchline keys init"),
    ):
        keys("issue", "operator", "anna")
        code, out, said = keys(*arguments)
        assert code == 2 and not out and said.startswith("error: ") and says in said and said.count("\n") == 1
