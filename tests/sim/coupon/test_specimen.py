"""A pulled specimen against its energy, against an integrated law, and against itself."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from defras_sim.coupon.specimen import nominal_stress_pa
from defras_sim.effects.library import effects

E_PA = 30e3


def pull(model, stretch, time_s=None):
    stretch = np.asarray(stretch, float)
    time_s = np.arange(len(stretch), dtype=float) if time_s is None else time_s
    return nominal_stress_pa(model, E_PA, time_s, stretch)


@pytest.mark.parametrize("effect", effects("coupon"), ids=lambda effect: effect.name)
def test_nothing_changes_at_the_null_values(effect):
    stretch = 1 + np.abs(np.sin(np.linspace(0, 9, 60)))
    null = {p.name: p.null for p in effect.parameters}
    assert np.array_equal(pull({effect.name: null}, stretch), pull({}, stretch))


def test_a_little_stretch_needs_youngs_modulus():
    assert pull({}, [1.0, 1.0 + 1e-6])[1] == pytest.approx(E_PA * 1e-6, rel=1e-5)


def test_stress_is_the_derivative_of_the_energy():
    # W / C10 of Yeoh's law in one free parameter, the stretch.
    stretch = np.linspace(0.7, 4.0, 30)
    excess = stretch**2 + 2 / stretch - 3
    slope = 2 * stretch - 2 / stretch**2
    c10 = E_PA / 6
    by_energy = c10 * slope + 2 * 0.3 * c10 * excess * slope
    model = {"strain_stiffening": {"coefficient": 0.3}}
    assert pull(model, stretch) == pytest.approx(by_energy)


def test_stiffness_scales_all_stress():
    stretch = 1 + np.abs(np.sin(np.linspace(0, 9, 60)))
    model = {"strain_stiffening": {"coefficient": 0.3}, "softening": {"share": 0.4}}
    stiffer = {"stiffness": {"scale": 1.7}, **model}
    assert pull(stiffer, stretch) == pytest.approx(1.7 * pull(model, stretch))


def test_relaxation_is_the_integrated_maxwell_element():
    time_s = np.linspace(0, 12, 400)
    stretch = 1 + np.clip(time_s / 2, 0, 1.0) + 0.3 * np.sin(time_s)
    stretch -= stretch[0] - 1
    fraction, tau_s = 0.6, 1.5
    found = pull({"stress_relaxation": {"fraction": fraction, "time_s": tau_s}}, stretch, time_s)
    elastic = pull({}, stretch)
    rate = np.diff(elastic) / np.diff(time_s)

    def spring_in_series(t, stress):
        return (
            rate[min(np.searchsorted(time_s, t, side="right") - 1, len(rate) - 1)] - stress / tau_s
        )

    part = solve_ivp(
        spring_in_series, (0, 12), [0.0], t_eval=time_s, rtol=1e-8, atol=1e-3, max_step=0.02
    ).y[0]
    assert found == pytest.approx(
        (1 - fraction) * elastic + fraction * part, abs=2e-3 * elastic.max()
    )


def test_a_hold_ends_at_what_does_not_fade():
    time_s = np.array([0.0, 1e-6, 1.0, 100.0])
    model = {"stress_relaxation": {"fraction": 0.35, "time_s": 1.0}}
    held = pull(model, [1.0, 1.5, 1.5, 1.5], time_s)
    assert held[1:] / held[1] == pytest.approx([1.0, 0.65 + 0.35 / np.e, 0.65], rel=1e-5)


def test_softening_spares_the_first_pull_and_what_goes_beyond():
    first = np.linspace(1, 2, 50)
    stretch = np.concatenate([first, first[::-1], first, np.linspace(2, 2.5, 20)])
    plain, softer = pull({}, stretch), pull({"softening": {"share": 0.4}}, stretch)
    assert softer[:50] == pytest.approx(plain[:50])
    assert softer[150:] == pytest.approx(plain[150:])
    assert (softer[101:149] < plain[101:149]).all()
    assert softer[100:150] == pytest.approx(softer[50:100][::-1])
    # At rest nearly all of the share is lost: erf(1 / 0.5).
    near = softer[101] / plain[101]
    assert near == pytest.approx(1 - 0.4 * 0.9953, abs=2e-3)


def test_the_order_in_which_effects_are_listed_does_not_matter():
    stretch = 1 + np.abs(np.sin(np.linspace(0, 9, 60)))
    model = {
        "stress_relaxation": {"fraction": 0.5, "time_s": 3.0},
        "softening": {"share": 0.4},
        "strain_stiffening": {"coefficient": 0.3},
        "stiffness": {"scale": 0.5},
    }
    assert np.array_equal(pull(model, stretch), pull(dict(reversed(model.items())), stretch))


def test_what_cannot_be_is_refused():
    with pytest.raises(ValueError, match="stretch should be positive"):
        pull({}, [1.0, 0.0])
    with pytest.raises(ValueError, match="joint_play cannot show in a specimen"):
        pull({"joint_play": {}}, [1.0, 1.1])
    with pytest.raises(ValueError, match=r"fraction should be between 0 and 0\.95"):
        pull({"stress_relaxation": {"fraction": 1.5}}, [1.0, 1.1])
