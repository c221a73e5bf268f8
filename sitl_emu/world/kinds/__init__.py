"""Kinds of worlds that are generated from options and a seed, a package each; nothing else names one of them."""
