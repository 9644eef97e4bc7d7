"""An oscillator with dry friction under a harmonic load, moving without stops.

`m x'' + k x = P cos(w t) - F sign(x')`, with r the frequency of the load over the natural one. A symmetric
motion without stops has half a period with constant friction between two turning points +-A:

    A^2 = (P / k)^2 V^2 - (F / k)^2 U^2,   V = 1 / (1 - r^2),   U = sin(pi / r) / (r (1 + cos(pi / r)))

(J. P. Den Hartog, Trans. ASME 53, 1931).
"""

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp

#: Frequency ratio, friction over load, and the largest |x| known before.
CASES_OF = (
    (0.8, 0.2, "2.711415255438"),
    (0.7, 0.25, "1.908955681058"),
    (1.5, 0.3, "0.721110255093"),
)


def amplitude(ratio, friction):
    """Return A k / P in 40 digits."""
    r, f = decimal(ratio), decimal(friction)
    v, u = 1 / (1 - r**2), mp.sin(mp.pi / r) / (r * (1 + mp.cos(mp.pi / r)))
    return mp.sqrt(v**2 - (f * u) ** 2)


def orbit(ratio, friction):
    """Return the orbit that the motion from rest settles to, under a given normal force of 1 N."""
    scene = ss.models.den_hartog(friction=friction, frequency_ratio=ratio)
    return ss.simulate(scene, 400.0, ss.State([0.0], [1e-3], "-")).limit_cycle()


def quantities():
    """Compare the largest |x| of the orbits."""
    rows = []
    for ratio, friction, known in CASES_OF:
        cycle = orbit(ratio, friction)
        assert cycle.load_periods == 1
        assert cycle.stable
        largest = max(float(cycle.maximum.sel(dof="x")), -float(cycle.minimum.sel(dof="x")))
        rows.append(
            Quantity(
                name=f"largest |x|, r = {ratio:g}, F / P = {friction:g}",
                unit="m",
                expected=amplitude(ratio, friction),
                computed=largest,
                reference=known,
            )
        )
    return rows


CASES = [
    Case(
        title="Oscillator with dry friction under a harmonic load",
        source=(
            "J. P. Den Hartog, Forced vibrations with combined Coulomb and viscous friction, "
            "Trans. ASME 53, 1931."
        ),
        model=(
            "`x'' + x = cos(r t) - f sign(x')`: m = k = P = 1, friction f. The motion without stops has the "
            "amplitude `A^2 = 1 / (1 - r^2)^2 - f^2 U^2` with `U = sin(pi / r) / (r (1 + cos(pi / r)))`. "
            "The program follows the motion from x' = 1e-3 until it recurs, and finds the periodic orbit."
        ),
        tolerance="Closed form: 1e-12.",
        quantities=quantities,
    )
]
