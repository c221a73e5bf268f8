"""Writes the scenario's agriculture.plan: the survey of the default corn field, as QGroundControl would save it.

python tools/agriculture/make_plan.py
"""

from pathlib import Path

from sitl_emu.gcs.plan_file import write_plan
from sitl_emu.missions.agriculture.survey import field_plan
from sitl_emu.world.kinds.corn_field import field as corn_field

PLAN = Path(__file__).parents[2] / "missions" / "agriculture" / "scenarios" / "agriculture.plan"


def main() -> None:
    """Write the plan."""
    place = (corn_field.ORIGIN_LAT_DEG, corn_field.ORIGIN_LON_DEG, corn_field.ORIGIN_ALT_AMSL_M)
    write_plan(PLAN, field_plan(*place, *corn_field.DEFAULT_SIZE_M))
    print(PLAN)


if __name__ == "__main__":
    main()
