"""Install marsupial as a reader of the README does, without `dev`, and use it there.

Two fresh environments get the newest versions of all dependencies and the lowest ones that pyproject.toml allows:
each first as by `pip install .`, then with the extras of a service. In each, commands run from an empty folder; each
must exit with 0. uv installs, as pip is configured here. Run by .ci/run; by hand: python3 .ci/installed.py [FOLDER]
"""

import ast
import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

RESOLUTIONS = {"newest": "highest", "lowest": "lowest-direct"}

EXTRAS = ".[service,engines,client]"

COMMANDS = (
    "marsupial map lobby --out map.png",
    "marsupial run lobby --steps 1 --log lobby.jsonl",
    "marsupial replay lobby.jsonl --html lobby.html",
    "marsupial export lobby.jsonl --at 20 -o moment",
    "marsupial plan moment/problem.pddl --planner aries --budget 15 -o plan.txt",
    "marsupial validate moment/domain.pddl moment/problem.pddl plan.txt",
    "marsupial compare lobby --carriers 1 --rovers 1 --runs 1 --steps 1 --workers 1 --out compared",
)

HANG_S = 900.0  # far longer than any step takes on a busy machine


class Failure(Exception):
    """A step that failed, with what it printed."""


def main() -> int:
    """Check both resolutions at once; return the exit code."""
    if sys.argv[1:]:
        return check_all(Path(sys.argv[1]).resolve())
    with tempfile.TemporaryDirectory(prefix="marsupial-installed-") as folder:
        return check_all(Path(folder))


def check_all(folder: Path) -> int:
    tools = folder / "tools"
    run([sys.executable, "-m", "venv", str(tools)])
    run([str(tools / "bin" / "pip"), "install", "--quiet", "uv"])
    environment = {**os.environ, **uv_settings(tools)}
    failed = 0
    with ThreadPoolExecutor(len(RESOLUTIONS)) as pool:
        checks = {
            name: pool.submit(check, folder / name, str(tools / "bin" / "uv"), resolution, environment)
            for name, resolution in RESOLUTIONS.items()
        }
        for name, done in checks.items():
            try:
                print(f"installed, {name} versions: {done.result()} commands succeeded", flush=True)
            except Failure as failure:
                failed += 1
                print(f"installed, {name} versions: {failure}", flush=True)
    return 1 if failed else 0


def uv_settings(tools: Path) -> dict[str, str]:
    """Return the environment variables that give uv the configuration of pip on this machine."""
    listed = run([str(tools / "bin" / "pip"), "config", "list"])
    options: dict[str, str] = {}
    for line in listed.splitlines():
        name, _, value = line.partition("=")
        options.setdefault(
            name.rpartition(".")[2], str(ast.literal_eval(value))
        )  # variables come first, and count more
    names = {
        "index-url": "UV_DEFAULT_INDEX",
        "extra-index-url": "UV_INDEX",
        "find-links": "UV_FIND_LINKS",
        "constraint": "UV_CONSTRAINT",
        "cert": "SSL_CERT_FILE",
    }
    given = {variable: options[name] for name, variable in names.items() if name in options}
    # As pip does: the best version of all indexes, not the first index that has any.
    return given | {"UV_INDEX_STRATEGY": "unsafe-best-match", "UV_LINK_MODE": "hardlink", "UV_HTTP_TIMEOUT": "180"}


def check(folder: Path, uv: str, resolution: str, environment: dict[str, str]) -> int:
    """Install into a fresh environment and run all commands; return how many there were."""
    place = folder / "environment"
    run([uv, "venv", "--quiet", "--python", sys.executable, str(place)], env=environment)
    install = [uv, "pip", "install", "--quiet", "--python", str(place / "bin" / "python"), "--resolution", resolution]
    work = folder / "work"
    work.mkdir()
    clean = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "NUMBA_", "VIRTUAL"))}
    clean |= {"PATH": f"{place / 'bin'}:{os.environ['PATH']}", "NUMBA_CACHE_DIR": str(folder / "code")}
    run([*install, "."], cwd=ROOT, env=environment)
    run(["python", "-c", "import marsupial; print(marsupial.scenario('lobby').name)"], cwd=work, env=clean)
    run(["marsupial", "--help"], cwd=work, env=clean)
    run([*install, EXTRAS], cwd=ROOT, env=environment)
    take_precompiled(place)
    for command in COMMANDS:
        run(shlex.split(command), cwd=work, env=clean)
    serve(work, clean)
    return len(COMMANDS) + 3


def take_precompiled(place: Path) -> None:
    """Copy the precompiled code of this checkout, if any: with the same numba it saves compiling."""
    (package,) = place.glob("lib/python*/site-packages/marsupial")
    if (ROOT / "marsupial" / "precompiled").is_dir():
        shutil.copytree(ROOT / "marsupial" / "precompiled", package / "precompiled", dirs_exist_ok=True)


def serve(work: Path, environment: dict[str, str]) -> None:
    """Start the service, wait for the result of a job, and stop it."""
    command = ["marsupial", "serve", "--port", "0", "--data", "served"]
    log = work / "serve.txt"
    with log.open("w") as output:
        server = subprocess.Popen(command, cwd=work, env=environment, stdout=output, stderr=output)
    try:
        served_job(server, log)
        server.send_signal(signal.SIGTERM)
        if code := server.wait(HANG_S):
            raise OSError(f"exit code {code} after SIGTERM")
    except (OSError, subprocess.TimeoutExpired, KeyError) as error:
        raise Failure(f"{shlex.join(command)}: {error!r}\n{log.read_text()}") from error
    finally:
        server.kill()
        server.wait()


def served_job(server: subprocess.Popen[bytes], log: Path) -> None:
    """Have the service plan one of its own examples."""
    address = None
    for _ in patiently():
        if server.poll() is not None:
            raise OSError(f"exit code {server.returncode}")
        if address := next((word for word in log.read_text().split() if word.startswith("http://")), None):
            break
    asked = fetched(f"{address}/v1/demo-data/yard")
    job = fetched(f"{address}/v1/jobs", json.dumps({**asked, "planner": "greedy"}).encode())
    for _ in patiently():
        job = fetched(f"{address}/v1/jobs/{job['id']}")
        if job.get("outcome"):
            break
    if not job["best"]["makespan_ms"] > 0:
        raise OSError(f"no plan: {job}")


def patiently():
    """Yield every fifth of a second; raise a TimeoutError when it has taken too long."""
    end = time.monotonic() + HANG_S
    while time.monotonic() < end:
        yield
        time.sleep(0.2)
    raise TimeoutError(f"nothing for {HANG_S:g} s")


def fetched(url: str, body: bytes | None = None) -> dict:
    request = urllib.request.Request(url, body, {"Content-Type": "application/json"})
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    with opener.open(request, timeout=60) as answer:
        return json.load(answer)


def run(command: list[str], *, cwd: Path | None = None, env: dict[str, str] | None = None) -> str:
    """Run a command to its end and return its output; raise Failure with it unless the exit code is 0."""
    try:
        done = subprocess.run(
            ["/usr/bin/env", *command], cwd=cwd, env=env, capture_output=True, text=True, timeout=HANG_S,
            stdin=subprocess.DEVNULL,
        )  # fmt: skip
    except subprocess.TimeoutExpired as error:
        raise Failure(f"{shlex.join(command)}: no end after {HANG_S:g} s") from error
    if done.returncode:
        raise Failure(f"{shlex.join(command)}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


if __name__ == "__main__":
    sys.exit(main())
