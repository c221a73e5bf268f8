"""What pyproject.toml has no words for: packages of sitl_emu that lie in other folders of the checkout.

Rooms that users look for at the top of the checkout are packages of sitl_emu all the same, and installed they are found
there alone: a user's own `missions/` or `gcs.py` is never taken for ours. The wheel carries tests/conformance as well.
"""

from setuptools import find_namespace_packages, setup

ROOMS = ("vehicles", "autopilot", "gcs", "missions")
ELSEWHERE = {f"sitl_emu.{room}": room for room in ROOMS} | {"sitl_emu.conformance": "tests/conformance"}

in_rooms = [f"sitl_emu.{name}" for name in find_namespace_packages(include=[f"{room}*" for room in ROOMS])]
conformance = [f"sitl_emu.{name}" for name in find_namespace_packages("tests", include=["conformance*"])]

setup(
    packages=sorted({*find_namespace_packages(include=["sitl_emu*"]), *in_rooms, *conformance}),
    package_dir=ELSEWHERE,
)
