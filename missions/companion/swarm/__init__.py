"""Several aircraft that talk and share work, without a centre: what any mission of more than one needs.

`key` and `seal` make broadcasts that nobody else can read, make or repeat; `records` is what they say.
"""
