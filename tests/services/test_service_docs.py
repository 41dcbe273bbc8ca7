import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from support.services.servers import Server
from support.waiting import HANG_S

ROOT = Path(__file__).resolve().parents[2]


def blocks(language: str, document: str = "docs/service.md") -> list[str]:
    text = (ROOT / document).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def run(command: list[str], server: Server, folder: Path) -> str:
    command = [word.replace("http://127.0.0.1:8080", server.url) for word in command]
    environment = {**os.environ, "no_proxy": "127.0.0.1"}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=HANG_S)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_example_with_curl_works(server: Server, tmp_path: Path) -> None:
    (script,) = blocks("sh")
    assert re.fullmatch(r"(optimal|satisficing) \d+\n", run(["sh", "-euc", script], server, tmp_path))


def test_the_examples_with_python_work(server: Server, tmp_path: Path) -> None:
    printed = run([sys.executable, "-c", "\n".join(blocks("python"))], server, tmp_path).splitlines()
    assert re.fullmatch(r"revision 1: \d+\.\d s", printed[0])
    assert printed[-2] in ("optimal", "satisficing")
    assert "t_" in printed[-1]


def test_the_program_of_forty_lines_explores_all_of_its_hall(server: Server, tmp_path: Path) -> None:
    (program,) = blocks("python", "docs/first-robot.md")
    assert sum(map(bool, program.splitlines())) <= 40
    printed = run([sys.executable, "-W", "error", "-c", program], server, tmp_path)
    (shown,) = blocks("text", "docs/first-robot.md")
    assert re.sub(r"\d+ reports", "", printed) == re.sub(r"\d+ reports", "", shown)
    (mission,) = [one for one in server.ask("GET", "/v1/missions").document["missions"] if one["name"] == "mission"]
    text = server.ask("GET", mission["links"]["log"]).document
    done = [json.loads(line)["action"]["name"] for line in text.splitlines() if '"event":"end"' in line]
    assert {"explore", "undock", "dock"} <= set(done)
    known = server.ask("GET", mission["links"]["map"]).document
    assert sum(known["runs"][1::3]) == known["width"] * known["height"]


def test_the_example_of_the_readme_with_python_works(server: Server, tmp_path: Path) -> None:
    (program,) = blocks("python", "README.md")
    printed = run([sys.executable, "-c", program], server, tmp_path).splitlines()
    assert re.fullmatch(r"\d+\.\d+ \w+ \w+ \w+", printed[0])


@pytest.mark.parametrize("block", blocks("json"))
def test_the_json_is_json(block: str) -> None:
    assert isinstance(json.loads(block), dict)
