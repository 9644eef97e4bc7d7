//! Elastic slip in a plane as products of series.
//!
//! The loss `y = e (e . w)` of the deflection ([`crate::scene::friction::elastic_plane`]) has along each direction i, with the other
//! one j, three products of a square and a velocity:
//!
//! ```text
//! y_i = e_i^2 w_i + (e_i + e_j)^2 w_j / 4 - (e_i - e_j)^2 w_j / 4
//! ```
//!
//! Each is a law of a deflection times a functional of the state, as those of bristles, with their recurrences and bounds.

use crate::contact::event_function::slip_velocity;
use crate::contact::functional::Functional;
use crate::scene::friction::bristles::square;
use crate::scene::friction::contact_state::StateContact;
use crate::scene::friction::elastic_plane::ElasticPlane;
use crate::scene::friction::law::FrictionLaw;
use crate::scene::model::Scene;

/// Law, argument and factor of each product along the first direction of a contact.
pub(crate) fn products(
    scene: &Scene,
    [contact, beside]: [usize; 2],
    plane: &ElasticPlane<'_>,
) -> [(FrictionLaw, [Functional; 2]); 3] {
    let direction = |own: &StateContact| {
        let (coordinate, weight) = own.as_velocity();
        let velocity = vec![(coordinate, weight / plane.extent)];
        Functional { velocity, ..Functional::default() }
    };
    let [own, other] = plane.directions.map(direction);
    let sum = |sign: f64| Functional::sum([(1.0, &own), (sign, &other)].into_iter());
    let [along, across] = [contact, beside].map(|one| slip_velocity(scene, one));
    let factors =
        [[own.clone(), along], [sum(1.0), across.scaled(0.25)], [sum(-1.0), across.scaled(-0.25)]];
    factors.map(|factors| (square(), factors))
}
