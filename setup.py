"""What pyproject.toml has no words for: the wheel carries tests/conformance, as sitl_emu/conformance.

It is a package of the wheel that lies in another folder of the checkout; the rest stands in pyproject.toml.
"""

from setuptools import find_namespace_packages, setup

ROOMS = ["sitl_emu*", "vehicles*", "autopilot*", "gcs*", "missions*"]

setup(
    packages=[*find_namespace_packages(include=ROOMS), "sitl_emu.conformance"],
    package_dir={"sitl_emu.conformance": "tests/conformance"},
)
