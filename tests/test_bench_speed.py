"""The speed benchmark: what it asks of the library can be asked."""

from benchmarks.rivals import Jaxcage, all_rivals


def test_every_setting_of_the_speed_table_is_one_that_the_library_takes():
    ours = [rival for rival in all_rivals() if isinstance(rival, Jaxcage)]
    assert len(ours) >= 5
    for rival in ours:
        for setting in (rival.tight, *rival.settings):
            assert (rival.method(setting) is None) == (setting is None)
