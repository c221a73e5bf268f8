"""`sitl-emu campaign`: a scenario flown over many seeds, in several arms, and what all of it says together."""
