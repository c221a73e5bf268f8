"""What PX4 logs of each topic, from our records: a row each, with PX4's names and meanings of fields.

A module for each module of `topics/`. A constant in here is what PX4 v1.18 tells in simulation too: where nobody sets
a field it is 0 there (`zeros`), where PX4 says that it does not know it is NaN.
"""
