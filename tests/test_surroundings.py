"""What tests need beside Python is there, or they fail and say so."""

import os
import subprocess
import sys
from pathlib import Path

import psycopg
import pytest
from support.services.databases import postgres_server
from support.waiting import HANG_S

TESTS = """
import pytest

def test_skipped(): pytest.skip("no database here")

@pytest.mark.xfail
def test_expected_to_fail(): assert False

def test_passed(): pass
"""

FILE = "import pytest\npytest.importorskip('no_such_package')\n"


@pytest.mark.parametrize(
    ("options", "expected"),
    [("--no-skips", "1 failed, 1 passed, 1 xfailed, 1 error"), ("", "1 passed, 2 skipped, 1 xfailed")],
)
def test_what_is_skipped_fails_where_everything_has_to_be_there(tmp_path: Path, options: str, expected: str) -> None:
    (tmp_path / "test_some.py").write_text(TESTS)
    (tmp_path / "test_file.py").write_text(FILE)
    environment = {**os.environ, "PYTEST_ADDOPTS": options, "PYTHONPATH": str(Path(__file__).parent)}
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-p",
        "conftest",
        "--continue-on-collection-errors",
        "-rN",
        "-c",
        os.devnull,
    ]
    found = subprocess.run([*command, tmp_path], env=environment, capture_output=True, text=True, timeout=HANG_S)
    assert f" {expected} in " in found.stdout
    assert found.stdout.count("although --no-skips is given") == (2 if options else 0)


def test_a_database_that_ended_is_started_again_and_its_log_printed(capsys: pytest.CaptureFixture[str]) -> None:
    with postgres_server("fsync=off") as server:
        server.crash()
        server.start_again()
        assert "the database server ended with -9" in capsys.readouterr().out
        psycopg.connect(server.url()).close()
        server.start_again()
        assert capsys.readouterr().out == ""
