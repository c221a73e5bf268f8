"""Several aircraft that talk and share work, without a centre: what any mission of more than one needs.

`key` and `seal` make broadcasts that nobody else can read, make or repeat; `records` is what they say. `sharing` is the
common work as one aircraft knows it: who is there, whose are which lines of an area (`division`), what was sighted by
whom (`targets`), and who serves it (`claims`). `airspace` keeps them apart. `swarm` puts these together.
"""
