"""`python -P -m sitl_emu`: the command line."""

from sitl_emu.cli import app

if __name__ == "__main__":
    app()
