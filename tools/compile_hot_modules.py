"""Compile the modules that run in every tick with mypyc, for this Python and these sources (sitl_emu/compiled.py).

    python tools/compile_hot_modules.py        # in the checkout, a minute on two cores; `make setup` calls it

Needs mypy, setuptools, a C compiler and Python's headers. Without them all runs as plain Python, slower and otherwise
the same; then this says what is missing, and is content.
"""

import contextlib
import io
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from sitl_emu import compiled

ROOT = Path(__file__).resolve().parents[1]
OPTIMISATION = "1"
"""Ours: a short set-up counts for more than what -O2 may add."""
LENIENT = ["--disable-error-code=has-type"]
"""mypyc takes files in another order than mypy and knows no types of what is decorated yet; mypy itself checks it."""
FLAGS = ["-ffp-contract=off", "-fvisibility=hidden", "-fno-plt", "-w"]
"""No fused multiply-add, where a processor has it: the same numbers as Python's. Calls and names within the library go
straight there: a tick that begins with cold caches touches less. mypyc's C is full of unused names."""


def missing() -> str:
    """What compiling lacks here; empty: nothing."""
    if shutil.which("cc") is None:
        return "no C compiler (apt install gcc)"
    if not Path(sysconfig.get_path("include"), "Python.h").is_file():
        return "no headers of Python (apt install python3-dev)"
    return ""


def translate(files: list[str], folder: Path) -> list[Any]:
    """The extensions to build (setuptools'), their C files under `folder`. Exits where mypyc refuses, and says why."""
    from mypyc.build import mypycify

    told = io.StringIO()  # mypyc also warns of what only costs it speed
    try:
        with contextlib.redirect_stdout(told), contextlib.redirect_stderr(told):
            extensions = mypycify(
                ["--config-file", "pyproject.toml", *LENIENT, *files],
                opt_level=OPTIMISATION,
                debug_level="0",
                multi_file=True,
                target_dir=str(folder),
                group_name=compiled.PACKAGE,
            )
    except SystemExit:
        print(told.getvalue(), file=sys.stderr)
        raise
    return list(extensions)


def read_ahead(command: list[str], folder: Path) -> list[str]:
    """Compile what all of mypyc's C files include once, under `folder`; the options to go on from there.

    That saves a quarter of what they take: half of them only hand out a module.
    """
    header = folder / "all.h"
    header.parent.mkdir(parents=True)
    names = (f"__native_{compiled.PACKAGE}.h", f"__native_internal_{compiled.PACKAGE}.h")
    header.write_text("".join(f'#include "{name}"\n' for name in names))
    subprocess.run([*command, "-x", "c-header", str(header), "-o", f"{header}.gch"], check=True)
    return ["-include", str(header)]


def build(extensions: list[Any], folder: Path, place: Path) -> None:
    """Compile all C files side by side, objects under `folder`, and link the modules into `place`."""
    from setuptools._distutils.ccompiler import new_compiler
    from setuptools._distutils.sysconfig import customize_compiler

    compiler = new_compiler()
    customize_compiler(compiler)
    (library,) = (extension for extension in extensions if extension.name == compiled.LIBRARY)
    include = [sysconfig.get_path("include"), *library.include_dirs]
    arguments = [*library.extra_compile_args, *FLAGS]
    arguments += read_ahead([*compiler.compiler_so, *(f"-I{path}" for path in include), *arguments], folder)

    def compiled_source(source: str) -> str:
        (made,) = compiler.compile([source], str(folder), include_dirs=include, extra_postargs=arguments)
        return str(made)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        jobs = [[pool.submit(compiled_source, source) for source in extension.sources] for extension in extensions]
        for extension, objects in zip(extensions, jobs, strict=True):
            file = place.joinpath(*extension.name.split(".")).with_suffix(sysconfig.get_config_var("EXT_SUFFIX"))
            file.parent.mkdir(parents=True, exist_ok=True)
            compiler.link_shared_object([job.result() for job in objects], str(file))


def main() -> None:
    """Compile, unless that is done already, and forget what was compiled of other sources."""
    os.chdir(ROOT)
    lacking = missing()
    if lacking:
        print(f"{lacking}: the autopilot runs as plain Python, at two thirds of its speed", file=sys.stderr)
        return
    files = compiled.sources({room: ROOT / "sitl_emu" / room for room in compiled.HOT})
    place = compiled.folder(files)
    if place.is_dir():
        return
    print(f"compiling {len(files)} modules that run in every tick, about a minute...", flush=True)
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as scratch:
        made = Path(scratch) / "made"
        extensions = translate([str(path.relative_to(ROOT)) for path in files.values()], Path(scratch) / "c")
        build(extensions, Path(scratch) / "o", made)
        (made / compiled.LIST).write_text("".join(f"{extension.name}\n" for extension in extensions))
        shutil.rmtree(compiled.FOLDER, ignore_errors=True)
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(made, place.with_suffix(".new"))
        place.with_suffix(".new").rename(place)
    print(f"compiled in {time.monotonic() - began:.0f} s")


if __name__ == "__main__":
    main()
