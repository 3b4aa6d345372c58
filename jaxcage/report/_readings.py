"""How a model reads what the paper leaves open: said beside everything that rests on it."""

from .._parameters import readings_of
from ..models import CageModel


_WHAT = {"clearance_reading": "radial clearance", "unbalance": "unbalance"}


def readings_document(model: CageModel) -> dict[str, str]:
    """The readings for programs."""
    return {name: chosen for name, (chosen, _) in readings_of(model).items()}


def readings_words(model: CageModel) -> str:
    """The readings in one line: `radial clearance c = C_r/2 ("radial"), unbalance M e omega^2 ("physical")`."""
    return ", ".join(f'{_WHAT[name]} {words} ("{chosen}")' for name, (chosen, words) in readings_of(model).items())


def short_readings(model: CageModel) -> str:
    """For titles of figures."""
    gap = {"radial": "c = C_r/2", "as_printed": "c = C_r"}[model.clearance_reading]
    return f"{gap}, {'physical' if model.unbalance == 'physical' else 'printed'} unbalance"
