"""Run the node: `ros2 run marsupial_node fleet --ros-args -p settings:=fleet.yaml`; docs/ros.md has its parameters."""

import asyncio
import os
import shlex
import signal
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path

from marsupial.errors import MarsupialError, UsageError
from marsupial_client import AsyncClient, ClientError
from marsupial_ros.bridge import PATIENCE_S, Bridge, BridgeOutcome
from marsupial_ros.journal import Journal
from marsupial_ros.native.display import MissionDisplay
from marsupial_ros.native.ros_node import RosNode
from marsupial_ros.native.transport import NativeTransport
from marsupial_ros.ros_listener import subscriptions
from marsupial_ros.settings import Settings, read_settings
from marsupial_ros.transport import first_of

SERVER = "http://127.0.0.1:8080"
LOCAL = "local"
# what the service prints before its address
SERVES = "marsupial serves at "
# signals this close are one request: a process group gets it, and `ros2 launch` passes it on as well (s)
TOGETHER_S = 1.0
# how long a service of our own may take to end
SERVE_END_S = 20.0


def main() -> int:
    """Run the node until its mission has ended, or a signal; 0 unless the mission has failed or nothing could run."""
    try:
        ended = asyncio.run(run_node()).ended
    except (MarsupialError, ClientError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0 if ended is None or ended["status"] in ("complete", "cancelled") else 1


async def run_node() -> BridgeOutcome:
    stops: list[float] = []  # when
    node = RosNode("marsupial")
    loop = asyncio.get_running_loop()

    def stop() -> None:
        if not stops or loop.time() > stops[-1] + TOGETHER_S:
            stops.append(loop.time())
            node.say("ending the mission; a second signal leaves at once")

    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop)
    try:
        settings = settings_of(node)
        state, key = node.parameter("state"), os.environ.get("MARSUPIAL_KEY")
        journal = Journal(Path(state) if state else None)
        async with service_of(node) as url, AsyncClient(url, key=key, patience_s=PATIENCE_S) as client:
            transport = NativeTransport(node, subscriptions(settings))
            bridge = Bridge(settings, transport, client, journal, node.say, lambda: len(stops))
            display = MissionDisplay(node, bridge, settings.map.frame)
            await first_of(_carry_out(bridge, display), display.run())
            if bridge.outcome.ended is not None:
                node.say(f"mission {bridge.state}")
            return bridge.outcome
    finally:
        node.close()


async def _carry_out(bridge: Bridge, display: MissionDisplay) -> None:
    await bridge.run()
    display.show()


def settings_of(node: RosNode) -> Settings:
    """Read the settings that the parameter names; `use_sim_time` means the usual clock. Raises InputError."""
    path = node.parameter("settings")
    if not path:
        raise UsageError("the parameter `settings` must name the file of the fleet")
    settings = read_settings(Path(path).expanduser())
    return replace(settings, clock="/clock") if node.simulated and settings.clock is None else settings


@asynccontextmanager
async def service_of(node: RosNode) -> AsyncIterator[str]:
    """Yield the address of the service; with ``server: local``, of one that is started and ended here."""
    url, command = node.parameter("server", SERVER), shlex.split(node.parameter("serve", "marsupial serve --port 0"))
    if url != LOCAL:
        yield url
        return
    try:
        # in a session of its own: Ctrl-C must not end it before its mission
        process = await asyncio.create_subprocess_exec(*command, stderr=asyncio.subprocess.PIPE, start_new_session=True)
    except OSError as error:
        raise UsageError(f"`{shlex.join(command)}` can't be started ({error.strerror})") from error
    assert process.stderr is not None
    try:
        said = ""
        while SERVES not in said:
            line = await process.stderr.readline()
            if not line:
                raise UsageError(f"`{shlex.join(command)}` has ended: {said.strip()}")
            said = line.decode(errors="replace")
        relay = asyncio.ensure_future(_relay(process.stderr))
        yield said.partition(SERVES)[2].split()[0]
        relay.cancel()
    finally:
        if process.returncode is None:
            process.terminate()
            try:
                await asyncio.wait_for(process.wait(), SERVE_END_S)
            except TimeoutError:
                process.kill()
                await process.wait()


async def _relay(stream: asyncio.StreamReader) -> None:
    """Show what the service says; unread, it would stop."""
    while data := await stream.read(2**16):
        sys.stderr.write(data.decode(errors="replace"))


if __name__ == "__main__":
    sys.exit(main())
