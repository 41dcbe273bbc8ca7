"""Backup, restore and removal in stores that are in use."""

import contextlib
import json
import shutil
import sqlite3
from pathlib import Path

import pytest
from mission_setup import Driver, add_mission, open_missions, started, team
from service_requests import client, problem
from support.services.databases import PostgresServer
from support.services.servers import Server
from support.waiting import HANG_S

from marsupial.cli.main import main
from marsupial.errors import UsageError
from marsupial_service.keys import KeyFile
from marsupial_service.missions.codeversion import code_version
from marsupial_service.operations import upkeep
from marsupial_service.store import StoreError, StoreInUse, open_store, tables
from marsupial_service.store.sqlite import FILE


async def test_a_mission_continues_in_a_folder_restored_from_a_backup_during_it(tmp_path: Path) -> None:
    folder, again, file = tmp_path / "data", tmp_path / "again", tmp_path / "backup"
    driver = Driver(team())
    async with open_missions(folder) as missions:
        record = await started(missions)
        assert not await driver.drive(missions, record, 5)
        KeyFile(folder).add("fleet", ["mission"], 1, now_s=0.0)
        upkeep.backup(folder, file)
        mission = record.id
    assert upkeep.restore(file, again) == (tables.VERSION, True)
    assert (again / "keys.json").read_text() == (folder / "keys.json").read_text()
    assert [path.stat().st_mode & 0o77 for path in (file, again / FILE, again / "keys.json")] == [0, 0, 0]
    async with open_missions(again) as missions:
        record = await missions.of("me", mission)
        assert record.n == 5
        assert await driver.drive(missions, record)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    open_store(tmp_path / "data").close()
    return tmp_path / "data"


def test_no_existing_file_is_overwritten(folder: Path, tmp_path: Path) -> None:
    upkeep.backup(folder, tmp_path / "backup")
    with pytest.raises(UsageError, match="backup already exists"):
        upkeep.backup(folder, tmp_path / "backup")
    with pytest.raises(UsageError, match="already has a store or keys"):
        upkeep.restore(tmp_path / "backup", folder)
    with pytest.raises(UsageError, match="no such file"):
        upkeep.restore(tmp_path / "none", tmp_path / "again")


def test_a_folder_in_use_is_not_restored_into(folder: Path, tmp_path: Path) -> None:
    upkeep.backup(folder, tmp_path / "backup")
    store = open_store(folder)
    (folder / FILE).rename(folder / "elsewhere")
    with pytest.raises(StoreInUse):
        upkeep.restore(tmp_path / "backup", folder)
    store.close()


def test_an_invalid_backup_is_refused_without_effect(folder: Path, tmp_path: Path) -> None:
    store = open_store(folder)
    store.write(lambda tx: [tx.insert("documents", name=f"{i}", text="x" * 3000) for i in range(99)]).result()
    store.close()
    good = tmp_path / "good"
    upkeep.backup(folder, good)
    data = bytearray(good.read_bytes())
    later, damaged, cut, text = (tmp_path / name for name in ("later", "damaged", "cut", "text"))
    page = data.index(b"x" * 2000) // 4096 * 4096
    damaged.write_bytes(data[:page] + b"\xff" * 4096 + data[page + 4096 :])
    cut.write_bytes(data[: len(data) // 2])
    text.write_text("no database" * 100)
    shutil.copy(good, later)
    flipped, unsigned = tmp_path / "flipped", tmp_path / "unsigned"
    at = data.index(b"x" * 2000) + 7  # in a text, where every page and reference stays sound
    flipped.write_bytes(data[:at] + b"y" + data[at + 1 :])
    unsigned.write_bytes(data[: data.rindex(b"\nmarsupial backup")])
    with contextlib.closing(sqlite3.connect(later)) as connection:
        connection.execute(f"PRAGMA user_version = {tables.VERSION + 1}")
    later.write_bytes(later.read_bytes()[: len(data) // 4096 * 4096])  # one without a checksum
    for file, why in (
        (damaged, "its checksum is another one"),
        (flipped, "its checksum is another one"),
        (cut, "damaged|malformed"),
        (text, "not a database"),
        (later, "version"),
    ):
        with pytest.raises(StoreError, match=why):
            upkeep.restore(file, tmp_path / "again")
        assert not (tmp_path / "again").exists()
    assert upkeep.restore(unsigned, tmp_path / "older") == (tables.VERSION, False)
    with pytest.raises(StoreError, match="is the file of a store in use"):
        upkeep.restore(folder / FILE, tmp_path / "again")
    assert upkeep.restore(good, tmp_path / "again") == (tables.VERSION, True)


def test_shared_databases_are_backed_up_with_their_own_tools(postgres: PostgresServer, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="pg_dump"):
        upkeep.backup(postgres.database(), tmp_path / "backup")


async def test_ended_entries_are_removed_at_once_and_open_ones_stay(place: str) -> None:
    async with open_missions(place) as missions:
        for _ in range(2):
            assert await Driver(team()).drive(missions, await started(missions))
        await started(missions)
        assert upkeep.info(place).open == {"jobs": 0, "missions": 1}
        assert upkeep.info(place).versions == {code_version(): 1}
        now_ms = missions.now_ms()
        assert upkeep.retain(place, days=1, kept=2, now_ms=now_ms) == {"jobs": 0, "missions": 0}
        assert upkeep.retain(place, days=None, kept=1, now_ms=now_ms) == {"jobs": 0, "missions": 1}
        assert upkeep.retain(place, days=0, kept=None, now_ms=now_ms + 1) == {"jobs": 0, "missions": 1}
        assert len(await missions.list("me")) == upkeep.info(place).rows["missions"] == 1


def test_the_commands_work_beside_a_server_and_a_full_store_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, again, file = tmp_path / "data", tmp_path / "again", str(tmp_path / "backup")

    def command(*words: str, folder: Path = data) -> int:
        return main(["serve", "store", *words, "--data", str(folder)])

    with Server(data, "--limit", "store_bytes=1") as server, client(server) as http:
        job = http.get("/v1/demo-data/tiny").json()
        made = http.post("/v1/jobs", json=job, headers={"Prefer": f"wait={HANG_S:g}"})
        assert made.status_code == 200
        assert (command("backup", file), command("info", "--json")) == (0, 0)
        shown = json.loads(capsys.readouterr().out)
        assert shown["rows"]["jobs"] == 1
        lines = dict(line.split() for line in http.get("/metrics").text.splitlines() if line.startswith("marsupial_st"))
        assert float(lines["marsupial_store_bytes"]) == shown["stored_bytes"]
        assert float(lines["marsupial_store_disk_bytes"]) > shown["stored_bytes"]
        while (full := http.post("/v1/jobs", json=job)).status_code != 507:
            assert full.status_code == 202
        assert "the limit is 1;" in problem(full, 507, "store-full")["detail"]
        assert int(full.headers["retry-after"]) == 60
        assert (command("retain"), command("retain", "--kept", "0")) == (2, 0)
        said = capsys.readouterr().err
        assert "removed " in said
        problem(http.get(made.json()["links"]["self"]), 404, "not-found")
    assert command("restore", file, folder=again) == 0
    assert command("info", "--live", folder=again) == 0
    out = capsys.readouterr().out
    assert "1 rows" in out
    assert "times as much" in out


def test_a_folder_without_a_store_is_an_error_and_stays_empty(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="no store in this folder"):
        upkeep.info(tmp_path)
    with pytest.raises(UsageError, match="--days, --kept"):
        upkeep.retain(tmp_path, days=None, kept=None, now_ms=0)
    (tmp_path / FILE).write_bytes(b"something else " * 100)
    with pytest.raises(StoreError, match="not a database"):
        upkeep.info(tmp_path)


def test_a_store_of_another_version_is_refused(place: str) -> None:
    store = open_store(place)
    number = "UPDATE marsupial SET version = 9" if "://" in place else "PRAGMA user_version = 9"
    store.write(lambda tx: tx.execute(number)).result()
    store.close()
    for act in (open_store, upkeep.info):
        with pytest.raises(StoreError, match=f"its tables have version 9, version {tables.VERSION} is required"):
            act(place)


def test_operators_see_which_open_missions_another_version_has_begun(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    store = open_store(tmp_path)
    store.write(lambda tx: add_mission(tx, "m", "me", 1, 0)).result()
    store.write(lambda tx: tx.execute("UPDATE missions SET finished_ms = NULL, version = '0.1.0+0ld'")).result()
    store.close()
    assert main(["serve", "store", "info", "--data", str(tmp_path)]) == 0
    assert f"1 of version 0.1.0+0ld; this one is {code_version()}" in capsys.readouterr().out
