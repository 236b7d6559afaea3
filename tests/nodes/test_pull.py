"""Pull lifts the held tissue straight up, to a height above the bed's rest plane."""

from defras_bt.acting.manoeuvre import Pull
from tests.nodes.manoeuvre_checks import ManoeuvreChecks


class TestPull(ManoeuvreChecks):
    leaf = Pull

    def target_m(self, bench, start_m):
        return [start_m[0], start_m[1], 0.04]
