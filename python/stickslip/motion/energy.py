"""Energy of a motion: what is stored, what flows in and out, and the balance between two times."""

from __future__ import annotations

from dataclasses import dataclass
from math import fsum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from stickslip import _core
from stickslip.scene.checks import Index, Names, Real, real_array
from stickslip.scene.scene import Scene
from stickslip.show.summary import Shown, Summary, Table

if TYPE_CHECKING:
    import xarray as xr

    from stickslip.motion.energy_figures import BalancePlots

#: Order of the statuses in tables.
STATUSES = ("+", "-", "s", "d", "o")


@dataclass(frozen=True, eq=False, repr=False)
class Balance(Shown):
    """Where the energy of the structure came from and went over (start, end]; J.

    ``stored = contact + external + circulatory - damping - impact + residual``, every term but the residual
    from its own formula, integrated in every phase to rounding. Impacts at `end` are in, those at `start` are
    not, so balances of adjoining intervals add up.

    Attributes
    ----------
    start, end
        The interval, s.
    kinetic, elastic
        Changes of ``1/2 x'^T M x'`` and ``1/2 x^T K x``, as ``1/2 (b + a)^T K (b - a)``; K with the symmetric
        part of a circulatory matrix H.
    stored
        Their sum.
    contact
        Work of the friction forces on the structure, ``sum_i integral T_i (t_i . x') dt``, positive when
        absorbed: the slider's work less the friction heat. Tangential impulses count in `impact`.
    external
        Work of the force F, ``F . (x(end) - x(start))``, and of the loads in time.
    circulatory
        Work of circulatory forces on the structure, ``-integral x'^T H_a x dt`` with ``H_a = (H - H^T) / 2``;
        0 without them. Gyroscopic forces do no work.
    damping
        Energy that the dampers dissipate, ``integral x'^T C x' dt``.
    dampers
        The same by damper group: ``mass`` and ``stiffness`` where damping is proportional, else ``dampers``.
    impact
        Energy that impacts take: normal loss ``1/2 m (1 - e^2) g'^2`` plus friction heat less slider work of
        the tangential impulses, and the energy of the relative motion that ends at the limit of a series of
        bounces.
    residual
        Difference of both sides: rounding, unless `accumulation_tolerance` cut bounces short.
    level
        Kinetic and elastic energy at both ends together, whose rounding is part of the residual.
    contacts
        Terms over (contact, status): ``work`` on the structure, ``slider`` work, ``friction_heat`` = slider
        less work, ``wear`` (Archard's integral of ``N |s|``, N m; impacts do not count), and ``time`` in that
        status, s. Terms over (contact): ``impact_normal``, ``impact_slider``, ``impact_friction``.
    combinations
        The same terms by status combination, dim combination, in order of first appearance: ``work`` (also by
        contact), ``external``, ``circulatory``, ``damping``, ``time``.
    states
        Number of states that were evaluated.
    """

    start: float
    end: float
    kinetic: float
    elastic: float
    stored: float
    contact: float
    external: float
    circulatory: float
    damping: float
    dampers: dict[str, float]
    impact: float
    residual: float
    level: float
    contacts: xr.Dataset
    combinations: xr.Dataset
    states: int

    @property
    def slider(self) -> float:
        """Work of all sliders, impacts included: what drives the motion, J."""
        return fsum([*self.contacts.slider.to_numpy().ravel(), *self.contacts.impact_slider.to_numpy()])

    @property
    def friction_heat(self) -> float:
        """Heat of all contacts, impacts' tangential impulses included, >= 0, J."""
        heat = self.contacts.friction_heat.to_numpy().ravel()
        return fsum([*heat, *self.contacts.impact_friction.to_numpy()])

    @property
    def impact_loss(self) -> float:
        """Lost by impacts in the normal direction, >= 0, J."""
        return fsum(self.contacts.impact_normal.to_numpy())

    @property
    def turnover(self) -> float:
        """Sum of the absolute work terms, J: the scale of the residual."""
        by_contact = self.contacts.work.sum("status").to_numpy()
        impacts = [self.contacts[name].to_numpy() for name in IMPACT_TERMS]
        others = [self.external, self.circulatory, self.damping]
        return fsum(np.abs([*by_contact, *others, *np.concatenate(impacts)]))

    @property
    def closes(self) -> bool:
        """Whether the residual is small: at most 1e-6 of the turnover and 1e-9 of the level.

        A larger one is named where the balance is printed. Then stiffnesses differ so much that the motion
        has lost its digits, or `accumulation_tolerance` cut bounces short.
        """
        return abs(self.residual) <= 1e-6 * self.turnover + 1e-9 * self.level

    def rows(self) -> list[tuple[str, float, str]]:
        """Return the terms of the balance: name, value with the sign it enters with, J, and its parts."""
        return [
            ("stored", self.stored, ""),
            ("contact", self.contact, ""),
            *self._by_contact(),
            ("external", self.external, ""),
            *([("circulatory", self.circulatory, "")] if self.circulatory else []),
            ("damping", -self.damping, ""),
            ("impact", -self.impact, ""),
            ("residual", self.residual, "" if self.closes else f"  ({self._gap()})"),
        ]

    def _gap(self) -> str:
        part = f", {abs(self.residual) / self.turnover:.1e} of the turnover" if self.turnover else ""
        return f"the balance does not close{part}"

    @property
    def plot(self) -> BalancePlots:
        """Pictures: ``balance.plot()``, the works as bars; ``balance.plot.flow()``."""
        from stickslip.motion.energy_figures import BalancePlots

        return BalancePlots(self)

    def to_dataset(self) -> xr.Dataset:
        """Return the terms, J, with `dampers` over ``damper``, and what `contacts` and `combinations` hold.

        The work through contacts is ``contact_work``; terms by status combination begin with
        ``combination_``. The attributes ``start`` and ``end``, s.
        """
        joule = {"units": "J"}
        terms = ("kinetic", "elastic", "stored", "external", "circulatory", "damping", "impact", "residual")
        by_combination = self.combinations.rename(
            {name: f"combination_{name}" for name in self.combinations.data_vars}
        )
        return (
            self.contacts.merge(by_combination)
            .assign({name: ((), getattr(self, name), joule) for name in terms})
            .assign(
                contact_work=((), self.contact, joule),
                dampers=("damper", list(self.dampers.values()), joule),
            )
            .assign_coords(damper=list(self.dampers))
            .assign_attrs(start=self.start, end=self.end)
        )

    def summary(self) -> Summary:
        """Return a table of the works."""
        caption = f"Energy from {self.start:g} s to {self.end:g} s"
        rows = [(name, value) for name, value, _ in self.rows()]
        facts = [] if self.closes else [("residual", self._gap())]
        return Summary(facts, [Table(caption, ("", "work, J"), rows)])

    def __repr__(self) -> str:
        width = max(10, *(len(name) for name, *_ in self.rows()))
        lines = [f"  {name:<{width}} {value + 0.0:+.6e} J{note}" for name, value, note in self.rows()]
        return "\n".join([f"Balance({self.start:g} s to {self.end:g} s)", *lines])

    def _by_contact(self) -> list[tuple[str, float, str]]:
        rows = []
        for label, work in zip(self.contacts.contact.to_numpy(), self.contacts.work.to_numpy(), strict=True):
            parts = [f"{status} {part:+.3e}" for status, part in zip(STATUSES, work, strict=True) if part]
            note = f"  ({', '.join(parts)})" if len(parts) > 1 else ""
            rows.append((f"  {label}", fsum(work), note))
        return rows


IMPACT_TERMS = ("impact_normal", "impact_slider", "impact_friction")


def energy(scene: Scene, core: _core.Trajectory, times: ArrayLike) -> xr.Dataset:
    """Return energies and powers of a computed motion; see `Motion.energy`."""
    import xarray as xr

    at = np.atleast_1d(real_array("times", times, 0, 1))
    sample = _core.energy(core, at)
    contact, slider = sample["contact"], sample["slider"]
    joule, watt = {"units": "J"}, {"units": "W"}
    by_contact = ("time", "contact")
    combination = np.array(sample["combination"], dtype=np.str_)
    return xr.Dataset(
        {
            "kinetic": ("time", sample["kinetic"], joule),
            "elastic": ("time", sample["elastic"], joule),
            "contact_power": (by_contact, contact, watt | {"sign": "into the structure"}),
            "slider_power": (by_contact, slider, watt | {"sign": "from the slider into the contact"}),
            "friction_heat": (by_contact, slider - contact, watt | {"sign": "dissipated in the contact"}),
            "wear_power": (by_contact, sample["wear"], watt | {"formula": "N |s|"}),
            "external_power": ("time", sample["external"], watt | {"sign": "into the structure"}),
            "circulatory_power": ("time", sample["circulatory"], watt | {"sign": "into the structure"}),
            "damping_power": ("time", sample["damping"].sum(axis=1), watt | {"sign": "dissipated"}),
            "damper_power": (("time", "damper"), sample["damping"], watt | {"sign": "dissipated"}),
            "energy_rate": ("time", sample["rate"], watt | {"sign": "dE/dt from the state equation"}),
            "combination": ("time", combination),
        },
        coords={
            "time": ("time", at, {"units": "s"}),
            "contact": scene.contact_labels(),
            "damper": list(sample["groups"]),
        },
    )


def balance(scene: Scene, core: _core.Trajectory, start: float, end: float) -> Balance:
    """Return the works over (start, end] of a computed motion; see `Motion.balance`."""
    works = _core.works(core, start, end)
    labels = scene.contact_labels()
    combination = np.array(works.combination, dtype=np.str_)
    contacts = _contacts(works, combination, labels)
    contact = fsum(works.contact.ravel())
    external, damping = fsum(works.external), fsum(works.damping.ravel())
    terms = [*works.contact.ravel(), *works.external, *works.circulatory, *(-works.damping.ravel())]
    taken = [*works.impact_normal, *works.impact_friction, *(-works.impact_slider)]
    ends = _core.energy(core, np.array([start, end]))
    return Balance(
        start=start,
        end=end,
        kinetic=works.kinetic,
        elastic=works.elastic,
        stored=works.kinetic + works.elastic,
        contact=contact,
        external=external,
        circulatory=fsum(works.circulatory),
        damping=damping,
        dampers={name: fsum(column) for name, column in zip(works.groups, works.damping.T, strict=True)},
        impact=fsum(taken),
        residual=fsum([works.kinetic, works.elastic, *(-np.array(terms)), *taken]),
        level=fsum([*ends["kinetic"], *ends["elastic"]]),
        contacts=contacts,
        combinations=_combinations(works, labels),
        states=works.states,
    )


def _contacts(works: _core.Works, combination: Names, labels: list[int] | list[str]) -> xr.Dataset:
    import xarray as xr

    statuses = combination.astype(f"<U{max(len(labels), 1)}").view("<U1").reshape(combination.size, -1)
    shape = (len(labels), len(STATUSES))
    work, slider, wear, time = (np.zeros(shape) for _ in range(4))
    for i in range(len(labels)):
        for k, status in enumerate(STATUSES):
            held = statuses[:, i] == status
            work[i, k] = fsum(works.contact[held, i])
            slider[i, k] = fsum(works.slider[held, i])
            wear[i, k] = fsum(works.wear[held, i])
            time[i, k] = fsum(works.duration[held])
    by_status, joule = ("contact", "status"), {"units": "J"}
    return xr.Dataset(
        {
            "work": (by_status, work, joule | {"sign": "into the structure"}),
            "slider": (by_status, slider, joule | {"sign": "from the slider into the contact"}),
            "friction_heat": (by_status, slider - work, joule | {"sign": "dissipated in the contact"}),
            "wear": (by_status, wear, joule | {"formula": "integral of N |s|"}),
            "time": (by_status, time, {"units": "s"}),
            **{
                name: ("contact", _by_contact(works.impact_contact, values, len(labels)), joule)
                for name, values in zip(
                    IMPACT_TERMS,
                    (works.impact_normal, works.impact_slider, works.impact_friction),
                    strict=True,
                )
            },
        },
        coords={"contact": labels, "status": list(STATUSES)},
    )


def _by_contact(contact: Index, values: Real, count: int) -> Real:
    return np.array([fsum(values[contact == i]) for i in range(count)])


def _combinations(works: _core.Works, labels: list[int] | list[str]) -> xr.Dataset:
    import xarray as xr

    names = list(dict.fromkeys(works.combination))
    # To compare every phase with every name takes seconds where each phase has a name of its own.
    by_name: dict[str, list[int]] = {name: [] for name in names}
    for row, name in enumerate(works.combination):
        by_name[name].append(row)
    held = list(by_name.values())
    work = [[fsum(column) for column in works.contact[rows].T] for rows in held]
    joule = {"units": "J"}
    return xr.Dataset(
        {
            "work": (("combination", "contact"), np.reshape(work, (len(names), len(labels))), joule),
            "external": ("combination", [fsum(works.external[rows]) for rows in held], joule),
            "circulatory": ("combination", [fsum(works.circulatory[rows]) for rows in held], joule),
            "damping": ("combination", [fsum(works.damping[rows].ravel()) for rows in held], joule),
            "time": ("combination", [fsum(works.duration[rows]) for rows in held], {"units": "s"}),
        },
        coords={"combination": names, "contact": labels},
    )
