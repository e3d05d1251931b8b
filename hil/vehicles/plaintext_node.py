"""The robot's end of the plaintext protocol: the SDK server of a RoboMaster EP."""

from collections.abc import Callable, Sequence

from hil.plants.mecanum import RIM_MPS_PER_RPM, body_velocity, wheel_rims_mps
from hil.vehicles.motion_controller import MotionController
from hil.vehicles.odometry import Odometry
from hil.vehicles.plaintext_grammar import DONE, FAILED, PARSE_ERROR, RefusalError, parse_command, values
from hil.vehicles.plaintext_move import MOVE_KEYS, Move, move
from hil.vehicles.plaintext_pushes import Pushes, push_text
from hil.wires.plaintext_ports import Port
from mtm_onboard.links.plaintext_messages import MOST_DEGPS, MOST_MPS, Splitter
from mtm_onboard.links.robomaster_messages import clockwise_deg, counter_clockwise_rad, flipped
from mtm_onboard.model.velocity import STOP

MOST_QUEUED = 512
MODES = ("chassis_lead", "gimbal_lead", "free")

_LONGEST_COMMAND = 1024
_MOST_RPM = 1000.0
_VERSION = "version 00.00.00.00"
_BATTERY = "84 "


class PlaintextMotionController:
    """Obeys text that arrives on `ports` and answers it; `poll` does everything that is due.

    The first port that says `command` has the robot until it says `quit` or its client goes; everybody else meets
    silence. SDK mode is the work mode of `controller`, which should have no deadman, as the robot has none: a speed
    holds until the next one or the end of SDK mode. While the gimbal leads, the chassis ignores turns.

    Obeyed are `command`, `quit`, `version`, `robot mode`, `robot battery ?`, and `chassis` with `speed`, `wheel`,
    `move`, `push` and the queries; anything else fails. `obeyed` and `refused` count commands of the port that has the
    robot, `unheard` those of the others, `dropped` those beyond what the robot queues. With `pushes_heading` pushed
    positions have the heading as a third number, as newer firmware sends, and otherwise two.
    """

    def __init__(self, controller: MotionController, ports: Sequence[Port], *, pushes_heading: bool = True) -> None:
        self.controller = controller
        self.obeyed = 0
        self.refused = 0
        self.unheard = 0
        self.dropped = 0
        self.mode = MODES[0]
        self._splitters = {port: Splitter(_LONGEST_COMMAND) for port in ports}
        self._owner: Port | None = None
        self._move: Move | None = None
        self._pushes_heading = pushes_heading
        self._pushes = Pushes()
        self._odometry = Odometry(controller.plant)
        self._handlers: dict[str, Callable[[tuple[str, ...], float], str]] = {
            "command": lambda words, _: _answer_alone(words, "Already in SDK mode"),
            "quit": self._on_quit,
            "version": lambda words, _: _answer_alone(words, _VERSION),
            "robot mode": self._on_mode,
            "robot battery": lambda words, _: _answer_query(words, _BATTERY),
            "chassis speed": self._on_speed,
            "chassis wheel": self._on_wheel,
            "chassis move": self._on_move,
            "chassis push": self._on_push,
            "chassis position": lambda words, _: _answer_query(words, self._position(with_heading=True)),
            "chassis attitude": lambda words, _: _answer_query(words, self._attitude()),
            "chassis status": lambda words, _: _answer_query(words, self._status()),
        }

    @property
    def is_taken(self) -> bool:
        """Whether a port has the robot in SDK mode."""
        return self._owner is not None

    @property
    def faults(self) -> int:
        """Commands that were refused or dropped, and texts too long to be one."""
        return self.refused + self.dropped + sum(splitter.overlong for splitter in self._splitters.values())

    def poll(self, now_s: float) -> None:
        """Obey what has arrived, advance the plant to `now_s` and push what is due."""
        for port, text in self._received():
            self._obey(port, text, now_s)
        self._go_on(now_s)
        self.controller.advance(now_s)
        due = self._pushes.due(now_s)
        if due and self._owner is not None:
            self._owner.push(push_text({name: self._attribute(name) for name in due}))

    def shutdown(self) -> None:
        """Release every line."""
        for port in self._splitters:
            port.shutdown()

    def _received(self) -> list[tuple[Port, str]]:
        queue: list[tuple[Port, str]] = []
        for port, splitter in self._splitters.items():
            data = port.receive()
            if data is None:
                splitter.clear()  # half a command dies with its connection
                if port is self._owner:
                    self._release()
            else:
                queue += [(port, text) for text in splitter.feed(data)]
        self.dropped += max(0, len(queue) - MOST_QUEUED)
        return queue[:MOST_QUEUED]

    def _obey(self, port: Port, text: str, now_s: float) -> None:
        has_robot = port is self._owner
        answer = echo = ""
        try:
            command = parse_command(text)
            echo = command.echo
            if self._owner is None and command.words == ("command",):
                has_robot = True
                answer = self._enter(port)
            elif has_robot:
                answer = self._done(command.words, now_s)
        except RefusalError as refusal:
            answer = str(refusal)
            self.refused += has_robot
        else:
            self.obeyed += has_robot
        if has_robot:
            port.answer(f"{answer}{echo};".encode("ascii"))
        else:
            self.unheard += 1

    def _enter(self, port: Port) -> str:
        self._owner = port
        self.controller.set_work_mode(True)
        return DONE

    def _done(self, words: tuple[str, ...], now_s: float) -> str:
        """Do what `words` say and return the answer; raises RefusalError."""
        for count in (2, 1):
            handler = self._handlers.get(" ".join(words[:count]))
            if handler is not None and len(words) >= count:
                return handler(words[count:], now_s)
        # Of other parts of the robot, such as a gimbal or an arm, this one has none.
        raise RefusalError(FAILED)

    def _go_on(self, now_s: float) -> None:
        """The chassis follows a move to its end, and then stands still."""
        if self._move is not None:
            self.controller.command_speed(now_s, *self._move.velocity(now_s))
            if self._move.is_over(now_s):
                self._move = None

    def _release(self) -> None:
        self._owner = self._move = None
        self.mode = MODES[0]
        self._pushes.clear()
        self.controller.set_work_mode(False)

    def _on_quit(self, words: tuple[str, ...], _now_s: float) -> str:
        answer = _answer_alone(words, DONE)
        self._release()
        return answer

    def _on_mode(self, words: tuple[str, ...], _now_s: float) -> str:
        if words == ("?",):
            return f"{self.mode} "
        if len(words) != 1 or words[0] not in MODES:
            raise RefusalError(PARSE_ERROR)
        self.mode = words[0]
        return DONE

    def _on_speed(self, words: tuple[str, ...], now_s: float) -> str:
        if words == ("?",):
            return self._speeds()
        wanted = values(words, ("x", "y", "z"))
        forward, rightward, clockwise = (wanted.get(key, 0.0) for key in ("x", "y", "z"))
        # Written so that what is not a number fails as well.
        if not (abs(forward) <= MOST_MPS and abs(rightward) <= MOST_MPS and abs(clockwise) <= MOST_DEGPS):
            raise RefusalError(FAILED)
        if self.mode == "gimbal_lead":
            clockwise = 0.0
        self._move = None
        self.controller.command_speed(now_s, forward, flipped(rightward), counter_clockwise_rad(clockwise))
        return DONE

    def _on_wheel(self, words: tuple[str, ...], now_s: float) -> str:
        wanted = values(words, ("w1", "w2", "w3", "w4"))
        if not all(abs(rpm) <= _MOST_RPM for rpm in wanted.values()):
            raise RefusalError(FAILED)
        # DJI's page swaps the rear wheels; this is the order of its binary protocol and of a client tested on robots.
        front_right, front_left, rear_left, rear_right = (
            wanted.get(key, 0.0) * RIM_MPS_PER_RPM for key in ("w1", "w2", "w3", "w4")
        )
        self._move = None
        velocity = body_velocity((front_left, front_right, rear_left, rear_right))
        self.controller.command_speed(now_s, *velocity)
        return DONE

    def _on_move(self, words: tuple[str, ...], now_s: float) -> str:
        self._move = move(values(words, MOVE_KEYS), now_s)
        return DONE

    def _on_push(self, words: tuple[str, ...], now_s: float) -> str:
        self._pushes.request(words, now_s)
        return DONE

    def _attribute(self, name: str) -> str:
        if name == "position":
            return self._position(with_heading=self._pushes_heading)
        return self._attitude() if name == "attitude" else self._status()

    def _position(self, *, with_heading: bool) -> str:
        x_m, y_m = self._odometry.position_xy_m
        heading = (clockwise_deg(self._odometry.heading_rad),) if with_heading else ()
        return _numbers(x_m, flipped(y_m), *heading)

    def _attitude(self) -> str:
        return _numbers(0.0, 0.0, clockwise_deg(self._odometry.heading_rad))

    def _status(self) -> str:
        """Eleven flags, of which the first says that the robot stands."""
        return f"{int(self.controller.plant.velocity_body == STOP)} " + 10 * "0 "

    def _speeds(self) -> str:
        velocity = self.controller.plant.velocity_body
        front_left, front_right, rear_left, rear_right = (
            rim_mps / RIM_MPS_PER_RPM for rim_mps in wheel_rims_mps(velocity)
        )
        # The rear wheels come in the other order than in `chassis wheel`, as that client reads them.
        speeds = _numbers(velocity.vx_mps, flipped(velocity.vy_mps), clockwise_deg(velocity.wz_radps))
        # Turns a minute are whole numbers: a client that is used with robots reads them as such.
        return speeds + "".join(f"{round(rpm)} " for rpm in (front_right, front_left, rear_right, rear_left))


def _numbers(*numbers: float) -> str:
    """Values as the robot writes them, each with a blank behind it."""
    return "".join(f"{number:z.3f} " for number in numbers)


def _answer_alone(words: tuple[str, ...], answer: str) -> str:
    if words:
        raise RefusalError(PARSE_ERROR)
    return answer


def _answer_query(words: tuple[str, ...], answer: str) -> str:
    if words != ("?",):
        raise RefusalError(PARSE_ERROR)
    return answer
