"""One mass on a spring with friction: on a belt, on the ground under a load, pulled over bristles or rock."""

from __future__ import annotations

import numpy as np

from stickslip.scene.checks import Pair, finite, pair, positive
from stickslip.scene.contact import Contact
from stickslip.scene.laws.friction import Law, Stribeck
from stickslip.scene.laws.law import FrictionLaw
from stickslip.scene.laws.state import Dahl, LuGre, RateState
from stickslip.scene.loads.in_time import Harmonic
from stickslip.scene.models.naming import named
from stickslip.scene.scene import Scene

#: Friction of the belt that falls over slip speed.
FALLING = Stribeck(static=0.5, kinetic=0.3, speed=0.1)


def _one_mass(mass: float, stiffness: float, damping: float, contact: Contact, *loads: Harmonic) -> Scene:
    c = finite("damping", damping)
    return Scene(
        [positive("mass", mass)],
        [[finite("stiffness", stiffness)]],
        damping=[[c]] if c else None,
        contacts=[contact],
        dofs=["x"],
        loads=loads,
    )


@named
def mass_on_belt(
    *,
    mass: float = 1.0,
    stiffness: float = 100.0,
    damping: float = 1.0,
    normal_force: float = 10.0,
    friction: float | FrictionLaw = FALLING,
    static_friction: float | None = None,
    slider_speed: float = 0.2,
) -> Scene:
    """Return a mass on a moving belt: ``m x'' + c x' + k x = N mu(v - x')`` while it slips behind the belt.

    Constant static and kinetic friction are those of H. Blok, "Fundamental mechanical aspects of boundary
    lubrication", SAE Journal 46 (1940); the law of the defaults falls as R. Stribeck measured it. Its steady
    sliding is unstable where ``c + N mu'(v) < 0``: below ``v = 0.1 log 20`` m/s with the defaults.

    Parameters
    ----------
    mass, stiffness, damping
        m, kg; k, N/m; c, N s/m.
    normal_force
        N, N.
    friction
        mu, a number or a law of `stickslip.friction`.
    static_friction
        Coefficient up to which the mass sticks to the belt; None: friction at rest.
    slider_speed
        v, m/s.

    Raises
    ------
    InputError
        If a parameter is ill-posed.
    """
    belt = Contact(
        tangential="x",
        normal_force=normal_force,
        friction=friction,
        static_friction=static_friction,
        slider_speed=slider_speed,
    )
    return _one_mass(mass, stiffness, damping, belt)


@named
def thomsen_fidlin(
    *,
    damping_ratio: float = 0.05,
    static: float = 0.4,
    least: float = 0.25,
    speed: float = 0.5,
    normal_force: float = 1.0,
    slider_speed: float = 0.4,
) -> Scene:
    """Return the mass on a belt of a cubic law: ``x'' + 2 beta x' + x = N mu(v - x')``.

    ``mu(s) = static - 3/2 (static - least) s / speed + 1/2 (static - least) (s / speed)^3``, J. J. Thomsen,
    A. Fidlin, "Analytical approximations for stick-slip vibration amplitudes", International Journal of
    Non-Linear Mechanics 38 (2003) 389. Mass and stiffness are 1. Steady sliding is stable above ``v1 = speed
    sqrt(1 - 4 beta speed / (3 N (static - least)))``. Below, the mass oscillates without sticking, at first
    order with the velocity ``2 sqrt(v1^2 - v^2)``, and below about ``v1 sqrt(4/5)`` it sticks.

    Parameters
    ----------
    damping_ratio
        beta.
    static, least
        Friction at rest, and its least value, which it has at the slip speed `speed`.
    speed
        Slip speed of the least friction, m/s.
    normal_force
        N, N; the squared parameter gamma of the paper.
    slider_speed
        v, m/s.

    Raises
    ------
    InputError
        If a parameter is ill-posed.
    """
    law = Law(
        "static - 1.5 * (static - least) * (s / speed) + 0.5 * (static - least) * (s / speed)**3",
        static=finite("static", static, least=0.0),
        least=finite("least", least, least=0.0),
        speed=positive("speed", speed),
    )
    belt = Contact(tangential="x", normal_force=normal_force, friction=law, slider_speed=slider_speed)
    return _one_mass(1.0, 1.0, 2.0 * finite("damping_ratio", damping_ratio), belt)


@named
def bistable_oscillator(
    *,
    damping_ratio: float = 0.05,
    kinetic: float = 0.5,
    static_ratio: float = 2.0,
    speed: float = 0.5,
    slider_speed: float = 1.5,
) -> Scene:
    """Return the friction oscillator of bSTAB: ``x'' + 2 xi x' + x = F(v - x')``.

    ``F(s) = mu_d (1 + (r - 1) exp(-s / v0))``, M. Stender, N. Hoffmann, "bSTAB: an open-source software for
    computing the basin stability of multi-stable dynamical systems", Nonlinear Dynamics 107 (2022), case
    ``case_friction``. With the defaults sliding and stick-slip are both stable between belt speeds of 1.1513
    and 1.8366 m/s.

    Parameters
    ----------
    damping_ratio
        xi.
    kinetic
        mu_d, the friction of fast slip under a normal force of 1 N.
    static_ratio
        r, friction at rest over that of fast slip.
    speed
        v0, decay of friction over slip speed, m/s.
    slider_speed
        v, m/s.

    Raises
    ------
    InputError
        If a parameter is ill-posed.
    """
    slow = finite("static_ratio", static_ratio, least=1.0) * finite("kinetic", kinetic, least=0.0)
    law = Stribeck(static=slow, kinetic=kinetic, speed=speed)
    belt = Contact(tangential="x", normal_force=1.0, friction=law, slider_speed=slider_speed)
    return _one_mass(1.0, 1.0, 2.0 * finite("damping_ratio", damping_ratio), belt)


@named
def den_hartog(
    *,
    mass: float = 1.0,
    stiffness: float = 1.0,
    damping: float = 0.0,
    friction: float = 0.2,
    load: float = 1.0,
    frequency_ratio: float = 0.8,
) -> Scene:
    """Return an oscillator with dry friction: ``m x'' + c x' + k x = P cos(r w t) - F sign(x')``.

    ``w = sqrt(k / m)``; J. P. Den Hartog, "Forced vibrations with combined Coulomb and viscous friction",
    Transactions of the ASME 53 (1931). Motion without stops has a closed form.

    Parameters
    ----------
    mass, stiffness, damping
        m, kg; k, N/m; c, N s/m.
    friction
        F, N: the coefficient under a normal force of 1 N.
    load
        P, N.
    frequency_ratio
        r.

    Raises
    ------
    InputError
        If a parameter is ill-posed.
    """
    rate = np.sqrt(positive("stiffness", stiffness) / positive("mass", mass))
    shaken = Harmonic({"x": load}, positive("frequency_ratio", frequency_ratio) * rate / (2.0 * np.pi))
    ground = Contact(tangential="x", normal_force=1.0, friction=friction)
    return _one_mass(mass, stiffness, damping, ground, shaken)


@named
def lugre_slider(
    *,
    mass: float = 1.0,
    stiffness: float = 2.0,
    pull_speed: float = 0.1,
    static: float = 1.5,
    kinetic: float = 1.0,
    speed: float = 1e-3,
    bristle_stiffness: float = 1e5,
    bristle_damping: float = 1e5**0.5,
    viscous: float = 0.4,
) -> Scene:
    """Return a mass on bristles that a spring pulls.

    ``m x'' = k (v t - x) - sigma0 z - sigma1 z' - sigma2 x'``, ``z' = x' - sigma0 |x'| z / g``, ``g = kinetic
    + (static - kinetic) exp(-(x' / speed)^2)``; C. Canudas de Wit, H. Olsson, K. J. Astrom, P. Lischinsky, "A
    new model for control of systems with friction", IEEE Transactions on Automatic Control 40 (1995) 419,
    Table I. The scene moves with the pulled end of the spring: its x is that above less v t, and the ground
    slides by at -v.

    Parameters
    ----------
    mass, stiffness
        m, kg; k, N/m.
    pull_speed
        v, m/s.
    static, kinetic
        Friction forces at rest and of fast slip, N, under a normal force of 1 N.
    speed
        Decay of friction over slip speed, m/s.
    bristle_stiffness, bristle_damping, viscous
        sigma0, N/m; sigma1 and sigma2, N s/m.

    Raises
    ------
    InputError
        If a parameter is ill-posed.
    """
    law = LuGre(static, kinetic, speed, bristle_stiffness, bristle_damping, viscous)
    ground = Contact(
        tangential="x", normal_force=1.0, friction=law, slider_speed=-finite("pull_speed", pull_speed)
    )
    return _one_mass(mass, stiffness, 0.0, ground)


@named
def dahl_oscillator(
    *,
    mass: float = 1.0,
    stiffness: float = 1e3,
    damping: float = 2.0,
    kinetic: float = 1.0,
    bristle_stiffness: float = 1e5,
    load: float = 1.0,
    frequency: float = 20.0,
) -> Scene:
    """Return an oscillator with Dahl's friction: ``m x'' + c x' + k x = P cos(2 pi f t) - F``.

    ``F' = sigma0 x' (1 - F sign(x') / kinetic)``, P. R. Dahl, "Solid friction damping of mechanical
    vibrations", AIAA Journal 14 (1976) 1675.

    Parameters
    ----------
    mass, stiffness, damping
        m, kg; k, N/m; c, N s/m.
    kinetic
        Friction force of fast slip, N, under a normal force of 1 N.
    bristle_stiffness
        sigma0, N/m.
    load, frequency
        P, N; f, Hz.

    Raises
    ------
    InputError
        If a parameter is ill-posed.
    """
    ground = Contact(tangential="x", normal_force=1.0, friction=Dahl(kinetic, bristle_stiffness))
    return _one_mass(mass, stiffness, damping, ground, Harmonic({"x": load}, frequency))


@named
def spring_slider(
    *,
    mass: float = 1.0,
    stiffness: float = 6e8,
    radiation: float = 0.0,
    normal_force: float = 1e6,
    reference: float = 0.6,
    direct: float = 0.01,
    evolution: float = 0.015,
    length: float = 1e-5,
    reference_speed: float = 1e-6,
    pull_speed: float = 1e-3,
) -> Scene:
    """Return a spring slider with rate and state: ``m x'' = k (v t - x) - eta x' - N mu``.

    ``mu = mu0 + a ln(x' / v0) + b ln(v0 theta / L)``, regularised at rest, ``theta' = 1 - x' theta / L``; J.
    R. Rice, A. L. Ruina, "Stability of steady frictional slipping", Journal of Applied Mechanics 50 (1983)
    343. Without radiation, steady slip is stable above ``k = (b - a) N / L (1 + m v^2 / (N a L))``. The scene
    moves with the pulled end of the spring, and the ground slides by at -v.

    Parameters
    ----------
    mass, stiffness
        m, kg; k, N/m.
    radiation
        eta, N s/m, the damping by waves that leave the slider.
    normal_force
        N, N.
    reference, direct, evolution
        mu0, a and b.
    length
        L, m.
    reference_speed, pull_speed
        v0 and v, m/s.

    Raises
    ------
    InputError
        If a parameter is ill-posed.
    """
    law = RateState(reference, direct, evolution, length, reference_speed)
    ground = Contact(
        tangential="x",
        normal_force=normal_force,
        friction=law,
        slider_speed=-finite("pull_speed", pull_speed),
    )
    return _one_mass(mass, stiffness, radiation, ground)


@named
def mass_on_belt_in_plane(
    *,
    mass: float = 1.0,
    stiffness: Pair = (100.0, 150.0),
    damping: Pair = (1.0, 1.0),
    normal_force: float = 10.0,
    friction: float | FrictionLaw = 0.4,
    static_friction: float | None = None,
    slider_speed: Pair = (0.2, 0.0),
) -> Scene:
    """Return a mass on a belt with friction in the plane: ``m x'' + C x' + K x = -mu N w / |w|``, two dofs.

    ``w = x' - v`` is the slip velocity, C and K are diagonal; such an oscillator is that of F. Xia,
    "Modelling of a two-dimensional Coulomb friction oscillator", Journal of Sound and Vibration 265 (2003)
    1063; the numbers are chosen here. Motion across steady sliding at v is damped by ``mu N / |v|``.

    Parameters
    ----------
    mass
        m, kg.
    stiffness, damping
        Of x and of y, N/m and N s/m; a number for both, or a pair.
    normal_force
        N, N.
    friction, static_friction
        mu, a number or a law over slip speed, and the coefficient up to which the mass sticks; None: mu at
        rest.
    slider_speed
        v, m/s, along x and y; a number is that along x.

    Raises
    ------
    InputError
        If a parameter is ill-posed.
    """
    m = positive("mass", mass)
    speeds = slider_speed if np.ndim(slider_speed) else (finite("slider_speed", slider_speed), 0.0)
    belt = Contact(
        tangential=("x", "y"),
        normal_force=normal_force,
        friction=friction,
        static_friction=static_friction,
        slider_speed=pair("slider_speed", speeds),
        name="belt",
    )
    return Scene(
        [m, m],
        np.diag(pair("stiffness", stiffness)),
        damping=np.diag(pair("damping", damping)),
        contacts=[belt],
        dofs=["x", "y"],
    )
