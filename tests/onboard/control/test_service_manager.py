import os
import socket

import pytest

from mtm_onboard.control.service_manager import ServiceManager


@pytest.fixture
def manager_socket(tmp_path):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as server:
        server.bind(str(tmp_path / "notify"))
        server.setblocking(False)
        yield server


def heard(server):
    texts = []
    while True:
        try:
            texts.append(server.recv(100))
        except BlockingIOError:
            return texts


def environment_of(server, **more):
    return {"NOTIFY_SOCKET": server.getsockname(), **more}


def test_a_run_says_ready_then_alive_then_stopping(manager_socket):
    manager = ServiceManager(environment_of(manager_socket, WATCHDOG_USEC="2000000"))
    manager.ready()
    manager.feed(10.0)
    manager.close()
    assert heard(manager_socket) == [b"READY=1\n", b"WATCHDOG=1\n", b"STOPPING=1\n"]


def test_the_watchdog_is_fed_four_times_in_its_period(manager_socket):
    manager = ServiceManager(environment_of(manager_socket, WATCHDOG_USEC="2000000"))
    for tick in range(100):
        manager.feed(tick * 0.02)
    manager.close()
    assert heard(manager_socket).count(b"WATCHDOG=1\n") == 4


def test_without_a_watchdog_it_is_fed_once_at_most(manager_socket):
    manager = ServiceManager(environment_of(manager_socket))
    for tick in range(1000):
        manager.feed(tick * 0.02)
    manager.close()
    assert heard(manager_socket).count(b"WATCHDOG=1\n") == 1


def test_another_process_is_asked_to_feed_and_not_this_one(manager_socket):
    environment = environment_of(manager_socket, WATCHDOG_USEC="1000", WATCHDOG_PID=str(os.getpid() + 1))
    manager = ServiceManager(environment)
    for tick in range(10):
        manager.feed(float(tick))
    manager.close()
    assert heard(manager_socket).count(b"WATCHDOG=1\n") == 1


def test_an_abstract_address_is_understood():
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as server:
        server.bind("\0mtm-test-notify")
        server.setblocking(False)
        manager = ServiceManager({"NOTIFY_SOCKET": "@mtm-test-notify"})
        manager.ready()
        manager.close()
        assert heard(server)[0] == b"READY=1\n"


@pytest.mark.parametrize("environment", [{}, {"NOTIFY_SOCKET": "/nowhere/at/all", "WATCHDOG_USEC": "oops"}])
def test_nobody_who_listens_is_no_reason_to_fail(environment):
    manager = ServiceManager(environment)
    manager.ready()
    manager.feed(0.0)
    manager.close()
    manager.close()


def test_a_listener_that_reads_nothing_never_holds_the_loop_up(manager_socket):
    manager = ServiceManager(environment_of(manager_socket, WATCHDOG_USEC="4"))
    for tick in range(5000):
        manager.feed(float(tick))
    manager.close()
