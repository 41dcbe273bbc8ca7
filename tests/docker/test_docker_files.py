from __future__ import annotations

import os
import re
from dataclasses import fields
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import pytest
import yaml

from marsupial.library import precompiling
from marsupial_service.settings import PREFIX, ServiceLimits

CHECKOUT = Path(__file__).resolve().parents[2]
DOCKER = CHECKOUT / "docker"


def instructions() -> list[tuple[str, str]]:
    """Return the instructions of the Dockerfile, continued lines joined."""
    text = re.sub(r"\\\n\s*", "", (DOCKER / "Dockerfile").read_text())
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    return [(name, rest) for name, _, rest in (line.partition(" ") for line in lines)]


def final_stage() -> list[tuple[str, str]]:
    all_of_them = instructions()
    last = max(i for i, (name, _) in enumerate(all_of_them) if name == "FROM")
    return all_of_them[last:]


@pytest.fixture(scope="module")
def service() -> Any:
    composed = yaml.safe_load((DOCKER / "compose.yaml").read_text())
    (name,) = composed["services"]
    return composed["services"][name]


def default(text: str) -> str:
    """Return a value of the compose file as it is where no variable is set."""
    return re.sub(r"\$\{\w+:-([^}]*)\}", r"\1", text)


def test_the_container_can_do_nothing_it_does_not_need(service: Any) -> None:
    assert service["read_only"] is True
    assert service["cap_drop"] == ["ALL"]
    assert "cap_add" not in service
    assert "privileged" not in service
    assert service["security_opt"] == ["no-new-privileges:true"]
    assert service["pids_limit"] > 0
    assert service["init"] is True


def test_nobody_is_root() -> None:
    users = [rest for name, rest in final_stage() if name == "USER"]
    assert users == ["10001:10001"]
    assert yaml.safe_load((DOCKER / "compose.yaml").read_text())["services"]["marsupial"]["user"] == users[-1]


def test_only_this_machine_can_connect(service: Any) -> None:
    assert all(default(port).startswith("127.0.0.1:") for port in service["ports"])


def test_what_may_be_written_is_the_data_and_a_small_tmp(service: Any) -> None:
    assert service["volumes"] == ["data:/data"]
    (tmp,) = service["tmpfs"]
    assert tmp.startswith("/tmp:size=")
    assert {"noexec", "nosuid", "nodev"} <= set(tmp.split(":")[1].split(","))
    environment = dict(rest.split("=", 1) for name, rest in final_stage() if name == "ENV" for rest in rest.split())
    assert environment["NUMBA_CACHE_DIR"].startswith("/tmp/")
    assert ("VOLUME", "/data") in final_stage()


def test_health_is_asked_of_the_service(service: Any) -> None:
    assert service["healthcheck"]["test"] == ["CMD", "health.py"]
    assert "/healthz" in (DOCKER / "health.py").read_text()
    assert any(name == "HEALTHCHECK" and "health.py" in rest for name, rest in final_stage())
    assert os.access(DOCKER / "health.py", os.X_OK)


def test_jobs_fit_into_the_memory_of_the_container(service: Any) -> None:
    known = {PREFIX + field.name.upper() for field in fields(ServiceLimits)}
    assert set(service["environment"]) <= known
    slots, each = (int(default(service["environment"][PREFIX + name])) for name in ("SLOTS", "MEMORY_BYTES"))
    assert default(service["mem_limit"]) == default(service["memswap_limit"]) == "4g"
    assert slots * each <= 3 << 30


def test_the_service_listens_where_it_asks_for_keys() -> None:
    (command,) = [rest for name, rest in final_stage() if name == "CMD"]
    assert '"--host", "0.0.0.0"' in command
    assert '"--data", "/data"' in command


def test_the_planner_for_educational_use_has_to_be_asked_for(service: Any) -> None:
    (extras,) = [rest for name, rest in instructions() if name == "ARG" and rest.startswith("EXTRAS=")]
    assert extras == "EXTRAS=service,aries"
    assert default(service["build"]["args"]["EXTRAS"]) == "service,aries"


def test_the_image_has_no_tools_to_build_or_install_with() -> None:
    (base,) = [rest for name, rest in final_stage() if name == "FROM"]
    assert "-slim-" in base
    run = " ".join(rest for name, rest in final_stage() if name == "RUN")
    assert "pip uninstall" in run
    assert not re.search(r"apt|pip install|gcc", run)


def test_what_is_copied_is_there_and_not_ignored() -> None:
    ignored = (DOCKER / "Dockerfile.dockerignore").read_text().split("\n")
    let_in = [line[1:] for line in ignored if line.startswith("!")]
    assert "*" in ignored
    copied = [rest.split()[:-1] for name, rest in instructions() if name == "COPY" and "--from" not in rest]
    for source in (word for words in copied for word in words if not word.startswith("--")):
        assert (CHECKOUT / source).exists()
        assert any(fnmatch(source, pattern) for pattern in let_in), source


def test_the_module_that_compiles_is_run_on_what_is_installed() -> None:
    """In the folder with the sources it would compile for those."""
    before = [(name, rest) for name, rest in instructions() if name in ("WORKDIR", "RUN")]
    (at,) = [i for i, (name, rest) in enumerate(before) if name == "RUN" and "precompiling" in rest]
    assert before[at - 1] == ("WORKDIR", "/")
    assert before[at][1].split() == ["/opt/marsupial/bin/python", "-m", precompiling.__name__]


@pytest.fixture(scope="module")
def cluster() -> Any:
    return yaml.safe_load((DOCKER / "cluster.yaml").read_text())["services"]


def test_a_cluster_is_closed_to_all_but_its_proxy(cluster: Any) -> None:
    assert [name for name, service in cluster.items() if "ports" in service] == ["proxy"]
    assert all(port.startswith("127.0.0.1:") for port in cluster["proxy"]["ports"])
    for name in ("ray-head", "ray-worker", "server-1", "server-2"):
        assert cluster[name]["environment"]["RAY_AUTH_MODE"] == "token"
        assert cluster[name]["environment"]["RAY_AUTH_TOKEN"].startswith("${RAY_AUTH_TOKEN:?")
        assert cluster[name]["user"] == "10001:10001"
    for name, service in cluster.items():
        assert service["security_opt"] == ["no-new-privileges:true"], name
        assert name == "postgres" or (service["read_only"], service["cap_drop"]) == (True, ["ALL"])


def test_the_servers_of_a_cluster_are_alike_and_know_store_and_cluster(cluster: Any) -> None:
    assert cluster["server-1"] == cluster["server-2"]
    environment, command = cluster["server-1"]["environment"], cluster["server-1"]["command"]
    known = {PREFIX + field.name.upper() for field in fields(ServiceLimits)}
    assert {name for name in environment if name.startswith(PREFIX)} <= {*known, "MARSUPIAL_STORE"}
    assert "@postgres/marsupial" in environment["MARSUPIAL_STORE"]
    assert command[-2:] == ["--ray", "ray://ray-head:10001"]
    assert "--ray-client-server-port=10001" in cluster["ray-head"]["command"]
    assert "--address=ray-head:6379" in cluster["ray-worker"]["command"]
    extras = default(cluster["server-1"]["build"]["args"]["EXTRAS"])
    assert {"service", "postgres", "ray"} <= set(extras.split(","))
    assert cluster["ray-head"]["image"] == cluster["server-1"]["image"]


def test_the_proxy_knows_the_servers_and_keeps_no_events_back() -> None:
    text = (DOCKER / "nginx.conf").read_text()
    assert re.findall(r"server (server-\d):8080", text) == ["server-1", "server-2"]
    assert "proxy_buffering off;" in text
    assert int(re.findall(r"proxy_read_timeout (\d+)s", text)[0]) > 15
    assert f"client_max_body_size {ServiceLimits().body_bytes // 1_000_000}m" in text
