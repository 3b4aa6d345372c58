"""The catalogue of bearings against ISO 76, geometry and the paper."""

import dataclasses
import math

import numpy as np
import pytest

from jaxcage.bearing import catalogue, listed, listed_like, nu2310, static_load_rating
from jaxcage.show import limiting_speed_notes, minimum_load_notes


@pytest.mark.parametrize("name", catalogue())
def test_rollers_give_the_printed_static_rating(name):
    """ISO 76 with the rollers of one maker gives the rating that another one prints."""
    found = listed(name)
    assert static_load_rating(found.bearing) == pytest.approx(
        found.static_rating, rel=0.04 if "n_rollers" not in found.estimated else 0.12
    )


@pytest.mark.parametrize("name", catalogue())
def test_rollers_fit_between_the_raceways(name):
    """The outer raceway lies outside the guiding shoulder, inside the outer diameter, and rollers do not touch."""
    b = listed(name).bearing
    assert float(b.rib_diameter) < float(b.outer_raceway_diameter) < float(b.outside_diameter)
    chord = float(b.pitch_diameter) * math.sin(math.pi / b.n_rollers) / float(b.roller_diameter)
    assert 1.15 < chord < 1.55
    assert float(b.roller_length) < float(b.width)


def test_the_bearing_of_the_paper_is_in_it():
    """Table 1 and the catalogue agree."""
    found, paper = listed("NU 2310 ECML").bearing, nu2310()
    assert listed_like(paper).designation == "NU2310"
    names = "bore outside_diameter width roller_diameter roller_length rib_diameter inner_raceway_diameter".split()
    assert [float(getattr(found, n)) for n in names] == [float(getattr(paper, n)) for n in names]
    assert found.n_rollers == paper.n_rollers


def test_minimum_load_by_hand():
    """SKF's rule for NU 2310 at the reference speed: 0.25 (6 + 4) 0.8^2 = 1.6 kN, 1.5 times as much in brass; the load
    grows by 14/10 from the reference speed to twice that."""
    found = listed("NU2310")
    np.testing.assert_allclose(found.minimum_loads(6700.0), (1600.0, 2432.0))
    np.testing.assert_allclose(found.minimum_loads(13400.0)[0] / 1600.0, 1.4)


def test_makers_rules_beside_a_computed_slip():
    """1.6 and 2.4 kN of SKF and C0/60 = 3.1 kN at 6700 rpm: a sentence where slip is small below or large above all."""
    notes = lambda load, slip: minimum_load_notes(nu2310(), load, 6700.0, slip)
    assert "is below all of them" in notes(1000.0, 0.5)[0]
    assert "is below C0/60 of NU2310 and SKF's rule, one-piece brass cage" in notes(2000.0, 0.5)[0]
    assert len(notes(1000.0, 0.5)) == len(notes(2000.0, 0.01)) == len(notes(4450.0, 0.01)) == 1
    assert "slip of the cage is 1.00%, although the load is below all" in notes(1000.0, 0.01)[1]
    assert "slip of the cage is 5.00%, although the load is above all" in notes(4450.0, 0.05)[1]


def test_the_rating_says_what_it_takes_for_the_length_that_carries():
    """C0 by ISO 76 of a bearing that is not in the catalogue, 44 (1 - 16/81) 13 25.5 16 = 187 kN, over 60."""
    wider = dataclasses.replace(nu2310(), width=41e-3)
    given = dataclasses.replace(wider, effective_length=25.5e-3)
    notes = [minimum_load_notes(each, 4450.0, 6700.0)[0] for each in (wider, given)]
    assert all("3.1 kN (C0/60, with C0 by ISO 76" in note for note in notes)
    assert ["1.5 mm below the roller's" in note for note in notes] == [True, False]
    assert minimum_load_notes(wider, 188e3, 6700.0)[1] == "The load is above C0 = 187 kN: look at its unit"
    assert len(minimum_load_notes(wider, 187e3, 6700.0)) == 1


def test_a_speed_beyond_the_makers_limit_is_named():
    """SKF's catalogue of 2018 prints 8 000 rpm for NU 2310 with its usual cage."""
    assert limiting_speed_notes(nu2310(), 8000.0) == []
    (note,) = limiting_speed_notes(nu2310(), 9000.0)
    assert "limits NU2310 to 8000 rpm of the shaft, 12000 rpm with a one-piece brass cage" in note


def test_an_unknown_designation_is_refused():
    with pytest.raises(ValueError, match="designation.*NU2310.*dimensions"):
        listed("6204")
