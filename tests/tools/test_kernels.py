"""A kernel that finds one of its ports taken."""

import socket

import kernels
import nbval.kernel
import pytest
from jupyter_client.manager import KernelManager

START = nbval.kernel.start_new_kernel
PORTS = "shell_port", "iopub_port", "stdin_port", "control_port", "hb_port"


def manager(taken=None, **options):
    """A manager that believes in five free ports; one may be taken."""
    free = [socket.create_server(("127.0.0.1", 0)) for _ in PORTS]
    ports = {name: door.getsockname()[1] for name, door in zip(PORTS, free, strict=True)}
    for door in free:
        door.close()
    if taken:
        ports["iopub_port"] = taken.getsockname()[1]
    return KernelManager(cache_ports=False, **ports, **options)


@pytest.fixture
def managers(monkeypatch):
    """Managers to come, in their order."""
    waiting = []
    monkeypatch.setattr(nbval.kernel, "KernelManager", lambda **kw: waiting.pop(0)(**kw))
    return waiting


@pytest.mark.slow
def test_it_is_started_again(managers):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        managers += [lambda **kw: manager(taken, **kw), manager]
        kernel, client = kernels.again(START)(kernel_name="python3", startup_timeout=3)
    client.stop_channels()
    kernel.shutdown_kernel(now=True)
    assert managers == []


def test_the_third_failure_is_told():
    tried = []

    def never(**options):
        tried.append(options)
        raise RuntimeError("Kernel didn't respond")

    with pytest.raises(RuntimeError, match="didn't respond"):
        kernels.again(never)(kernel_name="python3")
    assert tried == [{"kernel_name": "python3"}] * kernels.STARTS
