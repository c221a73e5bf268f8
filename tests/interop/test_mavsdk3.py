"""MAVSDK 3, which talks to a server of its own by gRPC, flies our vehicle by a script as its users have it.

Both MAVSDKs are called `mavsdk`, so this one lies in a folder of its own, where `make` puts it.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.launched import launched

MAVSDK3 = Path(sys.prefix) / "mavsdk3"
SCRIPT = Path(__file__).with_name("mavsdk3_script.py")
INSTANCE = 2
GRPC_PORT = 50070
LIMIT_S = 330.0


@pytest.mark.skipif(not MAVSDK3.is_dir(), reason=f"no {MAVSDK3}: `make test` installs MAVSDK 3 there")
def test_a_mavsdk_3_script_flies_the_vehicle() -> None:
    with launched("iris", "--instance", str(INSTANCE), "--speed", "4"):
        command = [sys.executable, "-P", str(SCRIPT), f"udpin://0.0.0.0:{14540 + INSTANCE}", str(GRPC_PORT)]
        run = subprocess.run(
            command,
            env={**os.environ, "PYTHONPATH": str(MAVSDK3), "PYTHONWARNINGS": "ignore"},
            capture_output=True,
            text=True,
            timeout=LIMIT_S,
        )
    assert run.stdout.splitlines() == [
        "connected",
        "version 1 18",
        "cruise 5.0",
        "parameters True",
        "in the air",
        "mission 2",
        "offboard NO_SETPOINT_SET",
        "offboard flown",
        "landed",
    ], run.stderr[-2000:]
