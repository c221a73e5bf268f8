"""Compiled kernels are kept as long as no kernel's source has changed."""

from pathlib import Path

from sitl_emu.world.render import kernel, raster, water


def test_a_change_in_any_kernel_s_file_is_another_stamp(tmp_path: Path) -> None:
    one, two, other = (tmp_path / name for name in ("one.py", "two.py", "other.py"))
    one.write_text("from sitl_emu.world.render.kernel import part\n")
    two.write_text("from sitl_emu.world.render.kernel import kernel\n")
    other.write_text("WITHOUT = 1\n")
    before = kernel.stamp_of((one, two, other))
    assert kernel.stamp_of((other, two, one)) == before
    other.write_text("WITHOUT = 2\n")
    assert kernel.stamp_of((one, two, other)) == before
    one.write_text(one.read_text() + "A = 1\n")
    assert kernel.stamp_of((one, two, other)) != before


def test_it_goes_with_what_numba_keeps_and_knows_kernels_and_their_parts() -> None:
    index = raster.project._cache._cache_file  # type: ignore[attr-defined]
    assert index._source_stamp == kernel.STAMP
    for module in (raster, water):
        assert module.__file__ is not None and b"render.kernel" in Path(module.__file__).read_bytes()
