"""Fold carries the held tissue away from the endoscope, which looks along +x here."""

from defras_bt.acting.manoeuvre import Fold
from tests.nodes.manoeuvre_checks import ManoeuvreChecks


class TestFold(ManoeuvreChecks):
    leaf = Fold

    def target_m(self, bench, start_m):
        return start_m + [0.05, 0.0, 0.0]
