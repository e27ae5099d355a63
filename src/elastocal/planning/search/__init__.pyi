from .candidates import Candidates as Candidates, Metric as Metric
from .cover import Cover as Cover, CoverSelection as CoverSelection
from .criteria import CRITERIA as CRITERIA, Criterion as Criterion, o1 as o1
from .detmax import Exchange as Exchange
from .exchange import ExchangeSearch as ExchangeSearch, ExchangeSelection as ExchangeSelection
from .growth import growing_choices as growing_choices
from .information import (
    EPSILON as EPSILON,
    Information as Information,
    build_information as build_information,
)
from .named import TECHNIQUES as TECHNIQUES, technique as technique
from .protocol import (
    SearchTechnique as SearchTechnique,
    Selection as Selection,
    check_count as check_count,
)
from .random_choice import RandomChoice as RandomChoice
from .spread import covering_radius as covering_radius, nearest_neighbour as nearest_neighbour
