"""What worlds around another one have in common: they forward what they do not change."""

from marsupial.model import Grid, World


class WorldAround:
    """Forwards questions and dockings to another world; derived classes decide about reports, drives and time."""

    def __init__(self, world: World) -> None:
        self._world = world
        # bound here, as a call through several worlds would take the time of several
        self.dock, self.undock, self.stop = world.dock, world.undock, world.stop
        self.distance_m, self.driving_ms, self.manoeuvres = world.distance_m, world.driving_ms, world.manoeuvres

    @property
    def grid(self) -> Grid:
        return self._world.grid

    @property
    def now_ms(self) -> int:
        return self._world.now_ms
