"""The robot's motion controller: work mode, newest command and deadman, whatever link the commands came over."""

from typing import Protocol

from mtm_onboard.model.velocity import STOP, BodyVelocity

DEADMAN_S = 0.2  # That of the Cambridge RoboMaster's ROS bridge; DJI publishes no figure for the firmware.


class Plant(Protocol):
    """The chassis under a motion controller."""

    def command(self, now_s: float, velocity: BodyVelocity) -> None:
        """Take the newest demanded body velocity."""
        ...

    def step(self, now_s: float) -> None:
        """Advance the physics to `now_s`."""
        ...

    @property
    def position_xy_m(self) -> tuple[float, float]:
        """Position in the world frame."""
        ...

    @property
    def heading_rad(self) -> float:
        """Heading, counter-clockwise from the world's x axis."""
        ...

    @property
    def velocity_body(self) -> BodyVelocity:
        """True body velocity."""
        ...


class MotionController:
    """State between the link and the plant.

    Commands are kept when they arrive and reach the plant at the next `advance`, as in a firmware loop. So the motion
    depends on the instants of `advance` alone, and not on the link a command took to get here.

    With `deadman_s` None the last command is kept for ever, the worst case.
    """

    def __init__(self, plant: Plant, deadman_s: float | None = DEADMAN_S) -> None:
        self.plant = plant
        self.deadman_s = deadman_s
        self.faults = 0
        self.ignored_commands = 0
        self.deadman_stops = 0
        self._work_mode = False
        self._demand = STOP
        self._fresh = False
        self._arrived_s = 0.0

    @property
    def work_mode(self) -> bool:
        """Whether the motors obey speed commands."""
        return self._work_mode

    @property
    def demand(self) -> BodyVelocity:
        """The command in force, or about to be at the next `advance`."""
        return self._demand

    def set_work_mode(self, on: bool) -> None:
        """Engage or release the motors; a change in either direction demands a standstill."""
        if on != self._work_mode:
            self._work_mode = on
            self._demand = STOP
            self._fresh = True

    def command_speed(self, now_s: float, vx_mps: float, vy_mps: float, wz_radps: float) -> None:
        """Keep a REP-103 body velocity that arrived at `now_s`.

        A command that is not finite is counted in `faults`, one that comes while the work mode is off in
        `ignored_commands`; neither changes the motion.
        """
        velocity = BodyVelocity(vx_mps, vy_mps, wz_radps)
        if not velocity.is_finite():
            self.faults += 1
        elif not self._work_mode:
            self.ignored_commands += 1
        else:
            self._demand = velocity
            self._arrived_s = now_s
            self._fresh = True

    def advance(self, now_s: float) -> None:
        """Step the plant to `now_s` under the old command, then apply the newest one or the deadman."""
        self.plant.step(now_s)
        if self._is_stale(now_s):
            self.deadman_stops += 1
            self._demand = STOP
            self._fresh = True
        if self._fresh:
            self._fresh = False
            self.plant.command(now_s, self._demand)

    def _is_stale(self, now_s: float) -> bool:
        return self.deadman_s is not None and self._demand != STOP and now_s - self._arrived_s > self.deadman_s
