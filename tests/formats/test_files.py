"""Files in the encodings of other systems, and wrong paths that mean a file nearby."""

import json
from pathlib import Path

import pytest
from support.planning.situations import one_room

from marsupial.cli.main import main
from marsupial.errors import InputError, LogError, SituationError
from marsupial.formats.files import nearby, read_text, utf8
from marsupial.formats.mapfiles.read import in_folder, read_map
from marsupial.formats.missionlog import parse_log
from marsupial.formats.pddl.text import problem_text
from marsupial.formats.scenario import is_scenario_file, read_scenario
from marsupial.formats.situation import situation_to_json
from marsupial.library.scenarios import load_scenario
from marsupial.library.situations import situation_of

YAML = "image: map.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
SCENARIO = """format: marsupial-scenario
version: 1
name: höf
map: {rows: ["....."], resolution_m: 1.0}
robot_types: [{name: c, role: carrier, speed_mps: 1, sensor_range_m: 2, radius_m: 0.2, terrains: [floor], capacity: 0}]
team: [{name: c1, type: c, start: [0.5, 0.5]}]
"""
ENCODINGS = ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32"]


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_text_is_read_in_every_unicode_encoding(tmp_path: Path, encoding: str) -> None:
    def written(name: str, text: str) -> Path:
        (tmp_path / name).write_bytes(text.replace("\n", "\r\n").encode(encoding))
        return tmp_path / name

    if encoding != "utf-32":  # libyaml has no UTF-32, but it is converted before
        assert utf8("aé".encode("utf-8-sig")) == "aé".encode()
    scenario = written("yard.yaml", SCENARIO)
    assert is_scenario_file(scenario)
    assert read_scenario(scenario).name == "höf"
    (tmp_path / "map.pgm").write_bytes(b"P5 2 1 255\n\xfe\x00")
    assert read_map(written("map.yaml", YAML)).grid.width == 2
    assert situation_of(written("a.json", situation_to_json(one_room()))) == one_room()
    assert situation_of(written("a.pddl", problem_text(one_room()))) == one_room()


def test_bytes_that_are_no_text_stay_what_they_are(tmp_path: Path) -> None:
    for data in (b"", b"a", b"\x89PNG", b"\x00\x00\x00\x00", b"a\x00b", b"\xe9t\xe9 2026"):
        assert utf8(data) == data
    (tmp_path / "a.txt").write_bytes(b"\xe9t\xe9 2026")
    with pytest.raises(InputError, match="is not UTF-8 text"):
        read_text(tmp_path / "a.txt", InputError)


def test_a_field_given_twice_is_named_with_its_line_whatever_the_file(tmp_path: Path) -> None:
    text = situation_to_json(one_room())
    line = text.splitlines().index('  "version": 1,') + 2
    (tmp_path / "a.json").write_text(text.replace('"version": 1,', '"version": 1,\n"version": 1,'))
    with pytest.raises(SituationError, match=f"line {line}: field 'version' is given twice"):
        situation_of(tmp_path / "a.json")
    with pytest.raises(LogError, match="line 1: is not JSON: field 'event' is given twice"):
        parse_log(b'{"event":"mission","event":"mission"}\n')


@pytest.mark.parametrize(
    ("written", "found"),
    [
        ("a.yaml", "a.yaml"),
        ("A.YAML", "a.yaml"),
        ("maps\\b.yaml", "maps/b.yaml"),
        ("/home/me/Maps/B.yaml", "maps/b.yaml"),
        ("other/b.yaml", None),
        ("maps", None),
        ("", None),
    ],
)
def test_a_wrong_path_means_the_file_of_its_last_names(tmp_path: Path, written: str, found: str | None) -> None:
    (tmp_path / "maps").mkdir()
    for name in ("a.yaml", "maps/b.yaml"):
        (tmp_path / name).touch()
    assert nearby(tmp_path, written) == found


def test_a_topic_behind_a_recording_is_not_taken_for_a_file_beside_it(tmp_path: Path) -> None:
    (tmp_path / "map").touch()
    (tmp_path / "run.mcap").touch()
    assert in_folder(tmp_path, "run.mcap#/map") == tmp_path / "run.mcap#/map"


def test_a_file_is_proposed_as_it_is_written_where_the_wrong_path_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for folder in ("maps", "elsewhere"):
        (tmp_path / folder).mkdir()
    (tmp_path / "maps" / "b.yaml").touch()
    monkeypatch.chdir(tmp_path)
    rows = '{rows: ["....."], resolution_m: 1.0}'
    Path("elsewhere/yard.yaml").write_text(SCENARIO.replace(rows, "{file: x/maps/b.yaml}"))
    with pytest.raises(InputError, match="no such file") as caught:
        read_scenario("elsewhere/yard.yaml")
    assert "did you mean" not in str(caught.value)
    assert main(["map", "x\\maps\\B.yaml"]) == 3
    assert "did you mean maps/b.yaml?" in capsys.readouterr().err


def test_a_tilde_is_the_home_folder_in_names_of_maps_and_scenarios(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    (tmp_path / "map.pgm").write_bytes(b"P5 2 1 255\n\xfe\x00")
    (tmp_path / "map.yaml").write_text(YAML.replace("resolution: 0.1", "resolution: 1.0"))
    assert read_map("~/map.yaml").grid.width == 2
    assert load_scenario("~/map.yaml").scenario.grid.width == 2
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    rows = '{rows: ["....."], resolution_m: 1.0}'
    for file in ("~/map.yaml", "..\\Map.yaml", "maps/../../map.yml"):
        (folder / "yard.yaml").write_text(SCENARIO.replace(rows, json.dumps({"file": file})))
        if file.startswith("~"):
            assert read_scenario(folder / "yard.yaml").grid.width == 2
        else:
            with pytest.raises(InputError, match=r"map.file: .*no such file"):
                read_scenario(folder / "yard.yaml")
