"""The speed benchmark: what it asks of the library can be asked."""

import jax


def test_every_setting_of_the_speed_table_is_one_that_the_library_takes():
    cache = jax.config.jax_enable_compilation_cache  # pyright: ignore[reportAttributeAccessIssue]
    from benchmarks.rivals import all_rivals
    from benchmarks.rivals_jaxcage import Jaxcage

    jax.config.update("jax_enable_compilation_cache", cache)  # importing the problem switches it off
    ours = [rival for rival in all_rivals() if isinstance(rival, Jaxcage)]
    assert len(ours) >= 5
    for rival in ours:
        for setting in (rival.tight, *rival.settings):
            assert (rival.method(setting) is None) == (setting is None or rival.solver is None)
