//! Parts of a scene that neither a matrix nor a contact couples.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::linalg::sparse::SparseMatrix;
use crate::scene::contact_coordinates::Coordinates;
use crate::scene::model::Scene;
use crate::scene::status::Combination;

/// One part, as a scene of its own in contact coordinates.
#[derive(Debug)]
pub(crate) struct Block {
    pub scene: Arc<Scene>,
    /// Its coordinates and contacts in the whole scene, ascending.
    pub coordinates: Vec<usize>,
    pub contacts: Vec<usize>,
}

impl Block {
    pub fn statuses(&self, whole: &Combination) -> Combination {
        let statuses = whole.statuses();
        Combination::new(self.contacts.iter().map(|&contact| statuses[contact]).collect())
    }

    pub fn gather(&self, whole: &[f64]) -> Vec<f64> {
        self.coordinates.iter().map(|&k| whole[k]).collect()
    }

    pub fn scatter(&self, part: &[f64], whole: &mut [f64]) {
        self.coordinates.iter().zip(part).for_each(|(&k, value)| whole[k] = *value);
    }
}

/// The blocks of a scene; none if all of it is coupled.
pub(crate) fn blocks_of(scene: &Scene) -> Vec<Block> {
    let n = scene.size;
    let mut root: Vec<usize> = (0..n).collect();
    fn find(root: &mut [usize], mut k: usize) -> usize {
        while root[k] != k {
            root[k] = root[root[k]];
            k = root[k];
        }
        k
    }
    let mut join = |i: usize, j: usize| {
        let (a, b) = (find(&mut root, i), find(&mut root, j));
        root[a.max(b)] = a.min(b);
    };
    for matrix in [&scene.mass, &scene.damping, &scene.stiffness] {
        for i in 0..n {
            matrix.row(i).filter(|entry| entry.1 != 0.0).for_each(|(j, _)| join(i, j));
        }
    }
    scene.contacts.iter().for_each(|contact| join(contact.tangential, contact.normal));
    let mut members: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for k in 0..n {
        members.entry(find(&mut root, k)).or_default().push(k);
    }
    if members.len() == 1 {
        return Vec::new();
    }
    members.into_values().map(|coordinates| block(scene, coordinates)).collect()
}

fn block(scene: &Scene, coordinates: Vec<usize>) -> Block {
    let place = |k: usize| coordinates.binary_search(&k).ok();
    let contacts: Vec<usize> = (0..scene.contacts.len())
        .filter(|&contact| place(scene.contacts[contact].normal).is_some())
        .collect();
    let laws = contacts.iter().map(|&contact| {
        let mut law = scene.contacts[contact].clone();
        for slot in [&mut law.tangential, &mut law.normal] {
            *slot = place(*slot).unwrap_or_default();
        }
        law
    });
    let laws: Vec<_> = laws.collect();
    let rows: Vec<usize> =
        contacts.iter().flat_map(|&contact| [2 * contact, 2 * contact + 1]).collect();
    let all = 2 * scene.contacts.len();
    let delassus = scene.coordinates.delassus.as_ref().and_then(|whole| {
        let part: Vec<f64> =
            rows.iter().flat_map(|&i| rows.iter().map(move |&j| whole[i * all + j])).collect();
        let coupled = (0..part.len()).any(|k| k / rows.len() != k % rows.len() && part[k] != 0.0);
        coupled.then_some(part)
    });
    let matrix = |whole: &SparseMatrix| whole.restricted(&coordinates);
    let part = Scene {
        size: coordinates.len(),
        impact_friction: scene.impact_friction,
        coordinates: Coordinates::of_contacts(
            laws.iter().map(|law| (law.tangential, law.normal)).collect(),
            delassus,
        ),
        contacts: laws,
        mass: matrix(&scene.mass),
        lumped: scene.lumped,
        damping: matrix(&scene.damping),
        proportional: scene.proportional,
        stiffness: matrix(&scene.stiffness),
        force: coordinates.iter().map(|&k| scene.force[k]).collect(),
    };
    Block { scene: Arc::new(part), coordinates, contacts }
}
