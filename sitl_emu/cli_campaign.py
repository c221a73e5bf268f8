"""`sitl-emu campaign`."""

from pathlib import Path
from typing import Annotated

import typer

from sitl_emu.cli_words import MOST_SEED, refuse


def campaign(
    scenario: Annotated[
        str,
        typer.Argument(metavar="SCENARIO", help="As for `run`: a name or a .yaml file.", show_default=False),
    ],
    runs: Annotated[int, typer.Option(min=1, metavar="N", help="How many runs of each arm.", show_default=False)],
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=A,B...",
            help="A dotted key of the scenario file and its values, an arm each: wind.north_m_s=0,4,8 or "
            "vehicles.uas.sensors.gps.noise_horizontal_m=0.5,2.5 (vehicles.* for all of them). Given several times: "
            "every combination.",
            show_default=False,
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=MOST_SEED,
            metavar="S",
            help="Of each arm's first run; the next have S+1 and so on. [default: the scenario's]",
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(min=1, metavar="N", help="Runs at a time on this machine. [default: one for two cores]"),
    ] = None,
    dask: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Fly on the Dask cluster of this scheduler, such as tcp://10.0.0.1:8786."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder of the campaign. [default: runs/campaign-SCENARIO-…, the same for the same command]",
        ),
    ] = None,
    keep: Annotated[
        str,
        typer.Option(
            metavar="all|failed|none", help="Which runs' folders are kept: an agriculture run's takes some 90 MB."
        ),
    ] = "all",
) -> None:
    """Fly a scenario over many seeds and in several arms; tables (CSV, Parquet) and a report of all runs together.

    The same command goes on where it ended, and more --runs add to it. Ends with exit status 0 when all runs are there,
    however they ended.
    """
    if keep not in ("all", "failed", "none"):
        refuse(f"--keep {keep}: give all, failed or none")
    if dask is not None and workers is not None:
        refuse("--dask and --workers: a cluster has as many places as its own workers; give one of them")
    from sitl_emu.run import output
    from sitl_emu.run.campaign import campaign as campaigns
    from sitl_emu.run.trouble import Trouble

    wanted = campaigns.Wanted(scenario, runs, vary or (), seed, workers, dask, out, keep)  # type: ignore[arg-type]
    try:
        status = campaigns.campaign(wanted, output.console())
    except Trouble as error:
        refuse(str(error))
    raise typer.Exit(status)
