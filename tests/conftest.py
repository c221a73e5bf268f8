"""No test touches the state folder of the user who runs it, and none is judged by how busy the machine is."""

import os
import signal
from collections.abc import Iterator

import pytest
from hypothesis import settings

settings.register_profile("sitl_emu", deadline=None, derandomize="CI" in os.environ)
"""An example has no time limit. Where CI is set (GitHub, GitLab), examples are the same in each run."""
settings.load_profile("sitl_emu")

# What a shell starts in the background ignores Ctrl-C, and so would all processes that tests start and end by it
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session", autouse=True)
def state_folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """`sitl-emu launch` without --state keeps its files in a temporary folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        yield


@pytest.fixture
def hears_hang_up() -> Iterator[None]:
    """SIGHUP is not ignored, as it is where the tests are run under nohup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)
