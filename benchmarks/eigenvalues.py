"""Complex eigenvalues: accuracy against 60-digit arithmetic, time against LAPACK through numpy and scipy."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable

import mpmath
import numpy as np
import scipy.linalg

import stickslip as ss
from report import Report, arguments

mpmath.mp.dps = 60

#: Defective points of the reference model.
LOCK_INS = (0.612484152848669, 1.989108991216879)
DISTANCES = (1.0, *(10.0**-k for k in range(1, 15)))
#: What the accuracy has to be: residual, error of a pair's mean, factor of the single eigenvalue's bound.
RESIDUAL, MEAN, SINGLE = 1e-13, 1e-12, 1e-14

#: A mean is judged relative to at least this part of its eigenvalues.
CANCELLED = 1e-3


def exact_eigenvalues(scene: ss.Scene) -> list[mpmath.mpc]:
    """All eigenvalues for positive sliding, from matrices formed and solved in 60 digits."""
    stiffness = np.asarray(
        scene.stiffness.toarray() if hasattr(scene.stiffness, "toarray") else scene.stiffness
    )
    normals = [contact.normal for contact in scene.contacts]
    merged = {contact.tangential: (contact.normal, contact.friction) for contact in scene.contacts}
    kept = [k for k in range(scene.size) if k not in normals]

    def reduced(matrix: np.ndarray) -> mpmath.matrix:
        result = mpmath.matrix(len(kept), len(kept))
        for i, row in enumerate(kept):
            for j, column in enumerate(kept):
                entry = mpmath.mpf(matrix[row, column])
                if row in merged:
                    normal, friction = merged[row]
                    entry -= mpmath.mpf(friction) * mpmath.mpf(matrix[normal, column])
                result[i, j] = entry / mpmath.mpf(scene.mass[row])
        return result

    if isinstance(scene.damping, ss.Rayleigh):
        alpha, beta = mpmath.mpf(scene.damping.mass), mpmath.mpf(scene.damping.stiffness)
        values = []
        for kappa in mpmath.eig(reduced(stiffness), left=False, right=False):
            half = (alpha + beta * kappa) / 2
            root = mpmath.sqrt(half**2 - kappa)
            values += [-half + root, -half - root]
        return values
    m = len(kept)
    state = mpmath.zeros(2 * m, 2 * m)
    springs, dashpots = reduced(stiffness), reduced(np.asarray(scene.damping))
    for i in range(m):
        state[i, m + i] = 1
        for j in range(m):
            state[m + i, j], state[m + i, m + j] = -springs[i, j], -dashpots[i, j]
    return list(mpmath.eig(state, left=False, right=False))


def matched(found: np.ndarray, exact: list[mpmath.mpc]) -> list[mpmath.mpc]:
    """The exact eigenvalue of each computed one; the nearest pair first."""
    rounded = np.array([complex(value) for value in exact])
    order = scipy.optimize.linear_sum_assignment(np.abs(found[:, None] - rounded[None, :]))[1]
    return [exact[k] for k in order]


def norms(modes: ss.Modes, scene: ss.Scene) -> tuple[np.ndarray, float]:
    """Condition k of each eigenvalue and the norm |A| that it belongs to: those of the scaled state matrix.

    With proportional damping `k |S| / |kappa|` of the mass-normalised stiffness S would be the looser bound.
    """
    m = modes.mass.shape[0]
    reduced = ss.equations_of(scene, modes.combination)
    root = np.sqrt(np.diag(reduced.mass))
    stiffness = reduced.stiffness / np.outer(root, root)
    damping = reduced.damping / np.outer(root, root)
    gamma = max(np.sqrt(np.abs(stiffness).sum(axis=1).max()), np.abs(damping).sum(axis=1).max())
    state = np.block([[np.zeros((m, m)), gamma * np.eye(m)], [-stiffness / gamma, -damping]])
    return modes.condition, float(np.linalg.norm(state, 2))


def judge(scene: ss.Scene) -> dict[str, float]:
    """Worst residual, worst error of a mean and worst single error over its bound."""
    modes = ss.complex_modes(scene, "++")
    value = modes.eigenvalues
    exact = matched(value, exact_eigenvalues(scene))
    error = np.array([abs(mpmath.mpc(v) - e) for v, e in zip(value, exact, strict=True)], dtype=float)
    condition, norm = norms(modes, scene)
    bound = SINGLE * condition * norm
    rounded = np.array([complex(e) for e in exact])
    distance = np.abs(rounded[:, None] - rounded[None, :]) + np.diag(np.full(value.size, np.inf))
    partner = distance.argmin(axis=1)
    # Where the bound exceeds half the distance to the neighbour, only the mean counts.
    single = bound <= 0.5 * distance.min(axis=1)
    coalescing = ~single | (distance.min(axis=1) <= 0.05 * np.abs(rounded))
    # Opposite eigenvalues do not coalesce but cancel: their mean is no better than their own rounding.
    means = [
        abs(mpmath.mpc(value[i]) - exact[i] + mpmath.mpc(value[j]) - exact[j])
        / max(abs(exact[i] + exact[j]), CANCELLED * abs(exact[i]))
        for i, j in enumerate(partner)
        if coalescing[i] and partner[j] == i
    ]
    return {
        "residual": float(modes.residual.max()),
        "mean": float(max(means, default=0.0)),
        "single": float((error / bound)[single].max(initial=0.0)),
        "condition": float(condition.max()),
    }


def random_scene(rng: np.random.Generator, kind: str) -> ss.Scene:
    """A random two-subsystem scene; `wide`: masses and stiffnesses over twelve orders of magnitude."""

    def factor(*shape: int) -> np.ndarray:
        return 10.0 ** rng.uniform(-6.0, 6.0, shape) if kind == "wide" else rng.uniform(0.2, 2.0, shape)

    scene = ss.models.two_subsystems(
        friction=rng.uniform(0.0, 3.0, 2),
        upper_mass=0.5 * factor(2),
        contact_mass=0.5 * factor(2),
        inclination=rng.uniform(-1.2, 1.2, 2),
        wall_stiffness=float(1e6 * factor()),
        vertical_stiffness=3e5 * factor(2),
        horizontal_stiffness=1e6 * factor(2),
        ceiling_stiffness=1e5 * factor(2),
        link_horizontal_stiffness=float(1e6 * factor()),
        link_vertical_stiffness=float(3e5 * factor()),
        damping=0.0 if kind == "undamped" else 10.0 ** rng.uniform(-6.0, -3.0),
    )
    if kind != "general":
        return scene
    root = rng.normal(size=(8, 8)) * 5.0
    return ss.Scene(
        scene.mass, scene.stiffness, damping=root @ root.T, force=scene.force, contacts=scene.contacts
    )


def accuracy(report: Report, count: int) -> bool:
    """Add the table of errors; return whether all of them are within their bounds."""
    rows, good = [], True

    def add(label: str, scenes: Iterable[ss.Scene]) -> None:
        nonlocal good
        results = [judge(scene) for scene in scenes]
        worst = {key: max(result[key] for result in results) for key in results[0]}
        good &= worst["residual"] <= RESIDUAL and worst["mean"] <= MEAN and worst["single"] <= 1.0
        rows.append([label, *(f"{worst[key]:.1e}" for key in ("condition", "residual", "mean", "single"))])

    for lock_in in LOCK_INS:
        label = f"reference model, {lock_in:.4f} + {DISTANCES[0]:.0e} to {DISTANCES[-1]:.0e}"
        add(label, [ss.models.two_subsystems(friction=lock_in + distance) for distance in DISTANCES])
    rng = np.random.default_rng(2024)
    for kind in ("proportional", "undamped", "wide", "general"):
        add(f"{count} random, {kind}", [random_scene(rng, kind) for _ in range(count)])
    report.table(
        ("scenes", "largest condition", "residual", "mean of the pair", "single, of its bound"), rows
    )
    return good


def best_of(repetitions: int, run: Callable[[], object]) -> float:
    """The shortest time of some runs, s."""
    times = []
    for _ in range(repetitions):
        begin = time.perf_counter()
        run()
        times.append(time.perf_counter() - begin)
    return min(times)


def state_matrices(scene: ss.Scene) -> tuple[np.ndarray, np.ndarray]:
    modes = ss.equations_of(scene, "+" * len(scene.contacts))
    zero = np.zeros_like(modes.mass)
    a = np.block([[modes.damping, modes.mass], [modes.mass, zero]])
    return a, np.block([[modes.stiffness, zero], [zero, -modes.mass]])


def sweep_times() -> tuple[float, float]:
    scene = ss.models.two_subsystems()
    values = np.linspace(0.0, 3.0, 1000)
    pencils = [state_matrices(scene.replace(friction=value)) for value in values]

    def lapack() -> None:
        for a, b in pencils:
            scipy.linalg.eig(-b, a, left=True, right=True)

    return best_of(10, lambda: ss.sweep(scene, {"friction": values}, vectors=True)), best_of(3, lapack)


def verdict_times(count: int) -> tuple[float, float]:
    rng = np.random.default_rng(1)

    def spread(value: object, *shape: int) -> np.ndarray:
        return np.asarray(value) * rng.uniform(0.5, 1.5, (count, *shape))

    drawn = {
        "friction": rng.uniform(0.0, 3.0, (count, 2)),
        "upper_mass": spread([0.3, 0.7], 2),
        "contact_mass": spread([0.3, 0.7], 2),
        "inclination": spread([0.3, 0.75], 2),
        "vertical_stiffness": spread([4.5e5, 3e4], 2),
        "horizontal_stiffness": spread([3e5, 2.4e6], 2),
        "ceiling_stiffness": spread([6e4, 1.8e5], 2),
        "wall_stiffness": spread(1.8e6),
        "link_horizontal_stiffness": spread([1.5e6], 1),
        "link_vertical_stiffness": spread([2.4e5], 1),
        "damping": spread(1e-4),
    }
    # The peer gets its state matrices ready made; a subset, because building them takes longer than the rest.
    part = count // 20
    states = np.empty((part, 12, 12))
    for i in range(part):
        values = {k: v[i, 0] if v.shape[1:] == (1,) else v[i] for k, v in drawn.items()}
        a, b = state_matrices(ss.models.two_subsystems(**values))
        states[i] = -np.linalg.solve(a, b)
    ours = best_of(5, lambda: ss.stability(ss.models.two_subsystems, drawn))
    found = ss.stability(ss.models.two_subsystems, drawn).growth_rate.to_numpy()[:part]
    peer = np.linalg.eigvals(states).real.max(axis=1)
    assert np.abs(found - peer).max() <= 1e-6 * np.abs(peer).max()
    return ours, best_of(3, lambda: np.linalg.eigvals(states)) * count / part


def chain_times(subsystems: int) -> tuple[float, float, float]:
    part = ss.models.Subsystem(
        upper_mass=0.3,
        contact_mass=0.7,
        inclination=0.4,
        vertical_stiffness=4.5e5,
        horizontal_stiffness=3e5,
        ceiling_stiffness=6e4,
    )
    rng = np.random.default_rng(0)
    parts = [
        ss.models.Subsystem(**{k: float(v * rng.uniform(0.9, 1.1)) for k, v in vars(part).items()})
        for _ in range(subsystems)
    ]
    link = ss.models.Link(horizontal_stiffness=1.5e6, vertical_stiffness=2.4e5)
    scene = ss.models.chain(
        parts, [link] * (subsystems - 1), wall_stiffness=1.8e6, friction=0.4, slider_speed=1.0
    )
    a, b = state_matrices(scene)
    half = ss.equations_of(scene, "+" * subsystems)
    normalised = half.stiffness / np.diag(half.mass)[:, None]
    return (
        best_of(3, lambda: ss.complex_modes(scene)),
        best_of(3, lambda: scipy.linalg.eig(-b, a, left=True, right=True)),
        best_of(3, lambda: scipy.linalg.eig(normalised, left=True, right=True)),
    )


def refined_times(free: int) -> tuple[float, float]:
    """Return the times of refined modes of a dense stiffness, and of LAPACK at half size."""
    contacts = free // 8
    n = free + contacts
    rng = np.random.default_rng(0)
    rotation = np.linalg.qr(rng.standard_normal((n, n)))[0]
    stiffness = (rotation * np.linspace(1e6, 1e9, n)) @ rotation.T
    force = np.zeros(n)
    force[contacts : 2 * contacts] = -1e3
    scene = ss.Scene(
        np.ones(n),
        0.5 * (stiffness + stiffness.T),
        force=force,
        damping=ss.Rayleigh(stiffness=1e-7),
        contacts=[
            ss.Contact(tangential=i, normal=contacts + i, friction=0.3, slider_speed=1.0)
            for i in range(contacts)
        ],
    )
    half = ss.equations_of(scene, "+" * contacts)
    normalised = np.linalg.solve(half.mass, half.stiffness)
    return (
        best_of(20, lambda: ss.complex_modes(scene)),
        best_of(20, lambda: scipy.linalg.eig(normalised, left=True, right=True)),
    )


def speed(report: Report) -> None:
    """Add the table of times."""
    rows = []

    def add(job: str, peer: str, ours: float, theirs: float) -> None:
        rows.append([job, peer, f"{1e3 * ours:.3g}", f"{1e3 * theirs:.3g}", f"{theirs / ours:.1f}"])

    add("1000 frictions, left and right vectors", "scipy, `eig(A, B)` in a loop", *sweep_times())
    add("100 000 stability verdicts", "numpy, `eigvals` of ready matrices", *verdict_times(100_000))
    ours, whole, half = chain_times(134)
    add("402 free coordinates, left and right vectors", "scipy, `eig(A, B)`", ours, whole)
    add("402 free coordinates, left and right vectors", "scipy, `eig` at half size", ours, half)
    add("60 free coordinates, dense, refined", "scipy, `eig` at half size", *refined_times(60))
    report.table(("job", "peer", "ms", "peer, ms", "ratio"), rows)


def main() -> None:
    """Print both tables."""
    parser = arguments(__doc__)
    parser.add_argument("--quick", action="store_true", help="a tenth of the random scenes")
    chosen = parser.parse_args()
    times = Report("eigenvalues")
    speed(times)
    times.finish(chosen.into, "stickslip", "numpy", "scipy")
    errors = Report("eigenvalue-errors")
    good = accuracy(errors, 10 if chosen.quick else 100)
    errors.finish(chosen.into, "stickslip", "numpy", "mpmath")
    if not good:
        raise SystemExit("accuracy: a bound is exceeded")


if __name__ == "__main__":
    main()
