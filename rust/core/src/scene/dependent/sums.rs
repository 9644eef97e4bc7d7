//! Coordinates that are sums of others, because directions of contacts depend on each other.

use crate::scene::coordinates::contact_coordinates::Coordinates;

/// `q_coordinate = sum_k factor_k q_k` over coordinates of x.
#[derive(Debug, Clone)]
pub(crate) struct Dependent {
    pub coordinate: usize,
    pub terms: Vec<(usize, f64)>,
}

/// The dependent coordinates of a new scene.
pub(crate) fn dependents_of(coordinates: &Coordinates) -> Vec<Dependent> {
    let dependent = |(coordinate, terms): &(usize, Vec<(usize, f64)>)| Dependent {
        coordinate: *coordinate,
        terms: terms.clone(),
    };
    coordinates.followers.iter().map(dependent).collect()
}

/// `dependents[index]` becomes a coordinate of x in place of `given`, which it contains with factor `pivot`.
pub(crate) fn exchange(dependents: &mut [Dependent], index: usize, given: usize, pivot: f64) {
    let Dependent { coordinate, terms } = dependents[index].clone();
    let others = terms.iter().filter(|term| term.0 != given);
    let solved = Dependent {
        coordinate: given,
        terms: std::iter::once((coordinate, 1.0 / pivot))
            .chain(others.map(|&(k, factor)| (k, -factor / pivot)))
            .collect(),
    };
    for other in dependents.iter_mut() {
        let Some(position) = other.terms.iter().position(|term| term.0 == given) else { continue };
        let (_, factor) = other.terms.swap_remove(position);
        let size = factor.abs();
        for &(k, inner) in &solved.terms {
            match other.terms.iter_mut().find(|term| term.0 == k) {
                Some(term) => term.1 += factor * inner,
                None => other.terms.push((k, factor * inner)),
            }
        }
        other.terms.retain(|term| term.1.abs() > f64::EPSILON * size);
    }
    dependents[index] = solved;
}
