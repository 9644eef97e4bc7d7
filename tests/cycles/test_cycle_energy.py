"""Energy over one limit cycle of the standard run: what is absorbed is released."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

import stickslip as ss


@pytest.fixture(scope="module")
def cycle(standard):
    """The last period of 3 s; the transient dies by 0.784 per period and has reached rounding."""
    run = ss.simulate(standard.scene, 3.0, standard.start)
    time = run.events.time
    period = run.limit_cycle(further=0.0).period
    first = int(np.argmin(np.abs(time[-1] - period - time)))
    return SimpleNamespace(run=run, begin=float(time[first]), period=float(time[-1] - time[first]))


@pytest.fixture(scope="module")
def balance(cycle):
    return cycle.run.balance(cycle.begin, cycle.begin + cycle.period)


@pytest.fixture(scope="module")
def orbit(standard):
    """The same cycle, refined to rounding."""
    return ss.simulate(standard.scene, standard.duration, standard.start).limit_cycle()


def test_what_flows_in_flows_out(cycle, balance):
    # Stored when the first contact begins to slip, both sliding from there on.
    events = cycle.run.events
    slips = events.time[(events.kind == "slip+") & (events.combination == "++")]
    stored = cycle.run.energy(slips[-1:])
    assert balance.damping == pytest.approx(2.1328e-3, abs=1e-7)
    assert float((stored.kinetic + stored.elastic).max()) == pytest.approx(79.3e-3, abs=1e-4)
    assert balance.impact == pytest.approx(32.3e-9, abs=1e-10)
    assert abs(balance.stored) < 1e-12 * balance.damping
    assert abs(balance.external) < 1e-12 * balance.damping
    assert abs(balance.contact - balance.damping - balance.impact) < 1e-12 * balance.damping
    assert abs(balance.residual) < 1e-13 * balance.turnover
    # The sliders drive the cycle; most of what they give becomes heat in the contacts.
    assert balance.slider - balance.friction_heat == pytest.approx(balance.contact, rel=1e-12)
    assert balance.friction_heat > 0.0


def test_the_first_contact_absorbs_while_sticking_and_releases_while_sliding(balance):
    work = balance.contacts.work.sel(contact=0)
    assert float(work.sel(status="s")) == pytest.approx(15.95e-3, abs=1e-5)
    assert float(work.sel(status="+")) == pytest.approx(-13.59e-3, abs=1e-5)
    assert float(work.sel(status=["-", "d"]).sum()) == 0.0
    # A detached contact has no force; the second one is open for a part of the cycle.
    second = balance.contacts.sel(contact=1)
    assert float(second.time.sel(status="d")) > 1e-4
    assert float(second.work.sel(status="d")) == 0.0


def test_times_and_works_by_status_and_by_combination_are_complete(cycle, balance):
    time = balance.contacts.time.sum("status")
    assert np.abs(time - cycle.period).max() <= 1e-15
    assert set(balance.combinations.combination.values) == {"++", "+d", "s+", "ss"}
    for parts in (balance.contacts.work.sum("status"), balance.combinations.work.sum("combination")):
        assert float(parts.sum()) == pytest.approx(balance.contact, rel=1e-12)
    assert float(balance.combinations.damping.sum()) == pytest.approx(balance.damping, rel=1e-14)
    assert sum(balance.dampers.values()) == pytest.approx(balance.damping, rel=1e-15)
    assert balance.dampers["mass"] == 0.0


def test_works_are_those_of_a_fine_quadrature_of_the_sampled_powers(cycle, balance):
    """Gauss rules of 20 nodes between events, on the powers that `energy` gives."""
    nodes, weights = np.polynomial.legendre.leggauss(20)
    times = cycle.run.events.time
    inside = times[(times >= cycle.begin) & (times <= cycle.begin + cycle.period)]
    contact, damping, external, heat = np.zeros(2), 0.0, 0.0, np.zeros(2)
    for begin, end in itertools.pairwise(inside):
        at = begin + 0.5 * (end - begin) * (1.0 + nodes)
        flow = cycle.run.energy(np.clip(at, begin, np.nextafter(end, begin)))
        weight = 0.5 * (end - begin) * weights
        contact += weight @ flow.contact_power.values
        heat += weight @ flow.friction_heat.values
        damping += weight @ flow.damping_power.values
        external += weight @ flow.external_power.values
    scale = 1e-12 * balance.slider
    assert np.abs(contact - balance.contacts.work.sum("status").values).max() <= scale
    assert np.abs(heat - balance.contacts.friction_heat.sum("status").values).max() <= scale
    assert abs(damping - balance.damping) <= scale
    assert abs(external - balance.external) <= scale


def test_the_refined_orbit_has_the_same_balance(orbit, balance):
    exact = orbit.balance()
    assert abs(exact.stored) < 1e-12 * exact.damping
    assert abs(exact.contact - exact.damping - exact.impact) < 1e-12 * exact.damping
    for name in ("contact", "damping", "impact", "slider", "friction_heat"):
        assert getattr(balance, name) == pytest.approx(getattr(exact, name), rel=1e-11)


def test_every_harmonic_dissipates_what_its_contact_forces_bring(orbit):
    exact, harmonics = orbit.balance(), orbit.harmonic_energy(512)
    brought = harmonics.friction_work.sum("contact") + harmonics.normal_work.sum("contact")
    # Forces of 1e7 N/m on amplitudes of 1e-4 m, whose real parts cancel.
    assert float(np.abs(brought - harmonics.damping).max()) <= 1e-12 * exact.damping
    assert (harmonics.damping >= 0.0).all()
    # One velocity jump in the period: works fall as 1 / k^2, and the rest of the sum as 1 / 512.
    jump = exact.impact
    assert float(harmonics.damping.sum()) == pytest.approx(exact.damping, abs=jump)
    assert float(harmonics.normal_work.sum()) == pytest.approx(-exact.impact, rel=5.0 / 512)
    for i in range(2):
        work = float(exact.contacts.work.isel(contact=i).sum())
        assert float(harmonics.friction_work.isel(contact=i).sum()) == pytest.approx(work, abs=jump)
    # The first harmonic carries nine tenths of the input.
    assert 0.85 * exact.damping < float(harmonics.damping.sel(harmonic=1)) < 0.95 * exact.damping


def test_mean_energies_are_the_sums_over_the_harmonics(orbit):
    harmonics = orbit.harmonic_energy(512)
    # The trapezoidal rule over a period is off by 1/N^2 of the jumps that the kinetic energy has.
    flow = orbit.run.energy(orbit.period * np.arange(20_000) / 20_000)
    assert float(harmonics.kinetic.sum()) == pytest.approx(float(flow.kinetic.mean()), rel=1e-7)
    assert float(harmonics.elastic.sum()) == pytest.approx(float(flow.elastic.mean()), rel=1e-10)
    with pytest.raises(ss.InputError, match="count"):
        orbit.harmonic_energy(0)
