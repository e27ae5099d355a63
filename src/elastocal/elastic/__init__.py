"""Springs, spring layouts and the elastic model of a robot (paper Eq. 1-14)."""
