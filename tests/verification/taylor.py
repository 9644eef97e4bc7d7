"""Motions without events by Taylor series, in 40 digits, for fields that are polynomials."""

from verification.case import mp

ORDER = 44


def product(a, b, k):
    """Return coefficient k of the product of two series."""
    return mp.fsum(a[j] * b[k - j] for j in range(k + 1))


def expanded(rates, state):
    """Return the series of a state; `rates(rows, k)` returns coefficient k of the derivatives.

    `rates` may keep products of the series in rows of its own behind those of the state.
    """
    rows = [[value] for value in state]
    for k in range(ORDER):
        for row, rate in zip(rows, rates(rows, k), strict=False):
            row.append(rate / (k + 1))
    return rows[: len(state)]


def evaluated(row, time):
    """Return the value of a series."""
    value = mp.mpf(0)
    for coefficient in reversed(row):
        value = value * time + coefficient
    return value


def until(rates, state, event, *, step, after=0):
    """Follow a motion to where a function of the state falls through zero, later than a time.

    Returns time and state there.
    """
    time = mp.mpf(0)
    while True:
        rows = expanded(rates, state)

        def at(s, rows=rows):
            return [evaluated(row, s) for row in rows]

        if event(at(0)) > 0 >= event(at(step)) and time + step > after:
            last = mp.findroot(lambda s, at=at: event(at(s)), (0, step), solver="anderson", tol=1e-70)
            return time + last, at(last)
        time, state = time + step, at(step)


def closed_orbit(returned, guess, steps=6):
    """Return the fixed point of a map, and the Jacobian of the map there, by some steps of Newton's method.

    Differences over 1e-20 leave half of the digits in the Jacobian, and all of them in the point.
    """
    place = mp.matrix(guess)
    for _ in range(steps):
        here = mp.matrix(returned(list(place)))
        jacobian = mp.matrix(len(place))
        for k in range(len(place)):
            moved = place.copy()
            moved[k] += mp.mpf(10) ** -20
            jacobian[:, k] = (mp.matrix(returned(list(moved))) - here) * mp.mpf(10) ** 20
        place += mp.lu_solve(mp.eye(len(place)) - jacobian, here - place)
    return list(place), jacobian
