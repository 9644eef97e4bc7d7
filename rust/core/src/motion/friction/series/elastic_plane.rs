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
//!
//! Under a normal force that changes, `e = z / (c N)` with the compliance `c = mu / k` per friction force, and the products are
//! formulas of a deflection and of N,
//!
//! ```text
//! y_i = e_i^2 w_i + (e_i + e_j)^2 w_j / 4 - (e_i - e_j)^2 w_j / 4 - (z_i / N) N'
//! ```

use std::sync::Arc;

use crate::contact::contact_forces::pressing;
use crate::contact::event_function::slip_velocity;
use crate::contact::functional::Functional;
use crate::error::input::Error;
use crate::motion::friction::series::law_contact::Fading;
use crate::scene::friction::bristles::square;
use crate::scene::friction::contact_state::StateContact;
use crate::scene::friction::elastic_plane::ElasticPlane;
use crate::scene::friction::formula::{Formula, GivenOperation};
use crate::scene::friction::law::FrictionLaw;
use crate::scene::model::Scene;
use crate::scene::status::Combination;

/// A product along the first direction of a contact.
pub(crate) struct Product {
    pub law: FrictionLaw,
    /// Argument and factor.
    pub factors: [Functional; 2],
    /// Where the normal force changes: this, which the law depends on besides, and what becomes of the product as it vanishes.
    pub pressed: Option<(Functional, Fading)>,
}

/// `x / N`, and `(x / (c N))^2`.
fn of_normal_force(compliance: f64) -> Result<[FrictionLaw; 2], Error> {
    let of = |name: &str, first, second, number| (name.to_owned(), first, second, number);
    let ratio = [of("state", 0, 0, 0.0), of("divide", 0, 1, 0.0)];
    let square = [
        of("constant", 0, 0, 1.0 / compliance),
        of("multiply", 2, 3, 0.0),
        of("multiply", 4, 4, 0.0),
    ];
    let law = |given: &[GivenOperation]| {
        Ok(FrictionLaw::Formula(Arc::new(Formula::in_direction(given, 1.0)?)))
    };
    Ok([law(&ratio)?, law(&[&ratio[..], &square].concat())?])
}

/// The products along the first direction of a contact.
pub(crate) fn products(
    scene: &Scene,
    combination: &Combination,
    [contact, beside]: [usize; 2],
    plane: &ElasticPlane<'_>,
) -> Result<Vec<Product>, Error> {
    let direction = |own: &StateContact| {
        let (coordinate, weight) = own.as_velocity();
        let per = plane.normal.map_or(plane.extent, |_| 1.0);
        let velocity = vec![(coordinate, weight / per)];
        Functional { velocity, ..Functional::default() }
    };
    let [own, other] = plane.directions.map(direction);
    let sum = |sign: f64| Functional::sum([(1.0, &own), (sign, &other)].into_iter());
    let [along, across] = [contact, beside].map(|one| slip_velocity(scene, one));
    let factors =
        [[own.clone(), along], [sum(1.0), across.scaled(0.25)], [sum(-1.0), across.scaled(-0.25)]];
    let Some(normal) = plane.normal else {
        let product = |factors| Product { law: square(), factors, pressed: None };
        return Ok(factors.map(product).into());
    };
    let [value, rate] = pressing(scene, combination, normal);
    let [ratio, square] = of_normal_force(plane.extent)?;
    let product = |law: &FrictionLaw, factors, largest| {
        let fading = Fading { contact: contact.min(beside), rate: rate.clone(), largest };
        Product { law: law.clone(), factors, pressed: Some((value.clone(), fading)) }
    };
    let squares = factors.into_iter().zip([1.0, 2.0, 2.0]);
    let mut all: Vec<Product> =
        squares.map(|(factors, largest)| product(&square, factors, largest)).collect();
    all.push(product(&ratio, [own, rate.scaled(-1.0)], plane.extent));
    Ok(all)
}
