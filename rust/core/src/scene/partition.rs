//! Parts of a scene that neither a matrix nor a contact couples.

use std::sync::Arc;

use crate::linalg::components::components;
use crate::linalg::sparse::SparseMatrix;
use crate::scene::coordinates::contact_coordinates::Coordinates;
use crate::scene::dependent::slaved_coordinates::{Slaved, SlavedCoordinates};
use crate::scene::friction::law::FrictionLaw;
use crate::scene::inertia::border::Terms;
use crate::scene::inertia::coupled_mass::coupled_mass;
use crate::scene::linear_terms::EnergyParts;
use crate::scene::loads::input::Loads;
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

/// The blocks of a scene; none if all of it is coupled, or if it has elements or bristles.
pub(crate) fn blocks_of(scene: &Scene) -> Vec<Block> {
    if scene.has_elements() || scene.has_states() || scene.planes().next().is_some() {
        return Vec::new();
    }
    let mut partner: Vec<Vec<usize>> = vec![Vec::new(); scene.size];
    for contact in &scene.contacts {
        partner[contact.tangential].push(contact.normal);
        partner[contact.normal].push(contact.tangential);
    }
    for Slaved { coordinate, terms, .. } in scene.dependents.iter() {
        for &(k, _) in terms.iter().filter(|term| term.0 < scene.structure()) {
            partner[*coordinate].push(k);
            partner[k].push(*coordinate);
        }
    }
    // Of unsymmetric matrices an entry couples both ways, too.
    let mirrored: Vec<SparseMatrix> = match &scene.bare().energy_parts {
        Some(_) => vec![scene.damping.transposed(), scene.stiffness.transposed()],
        None => Vec::new(),
    };
    // Coordinates that carry loads couple nothing: each part has its own copy of them.
    let n = scene.structure();
    let entries = |matrix: &SparseMatrix, i: usize, found: &mut Vec<usize>, carries: bool| {
        let row = matrix.row(i).filter(|entry| entry.1 != 0.0 && (entry.0 >= n) == carries);
        found.extend(row.map(|entry| entry.0));
    };
    let parts = components(n, |i, found| {
        found.extend_from_slice(&partner[i]);
        for matrix in scene.matrices().into_iter().chain(&mirrored) {
            entries(matrix, i, found, false);
        }
    });
    if parts.len() == 1 {
        return Vec::new();
    }
    let block_of = |structure: Vec<usize>| {
        let mut carriers = Vec::new();
        for &i in &structure {
            entries(&scene.damping, i, &mut carriers, true);
            entries(&scene.stiffness, i, &mut carriers, true);
        }
        // A slider may vibrate a part that does not feel it.
        let carried = scene.drive.iter().flat_map(|drive| &drive.carried);
        let own = carried.filter(|carried| structure.binary_search(&carried.tangential).is_ok());
        carriers.extend(own.map(|carried| carried.oscillator.coordinate));
        carriers.sort_unstable();
        carriers.dedup();
        let bare = scene.bare.as_deref();
        let bare = bare.map(|bare| block(bare, structure.clone(), None).scene);
        block(scene, [structure, carriers].concat(), bare)
    };
    parts.into_iter().map(block_of).collect()
}

fn block(scene: &Scene, coordinates: Vec<usize>, bare: Option<Arc<Scene>>) -> Block {
    let place = |k: usize| coordinates.binary_search(&k).ok();
    let contacts: Vec<usize> = (0..scene.contacts.len())
        .filter(|&contact| place(scene.contacts[contact].normal).is_some())
        .collect();
    let laws = contacts.iter().map(|&contact| {
        let mut law = scene.contacts[contact].clone();
        for slot in [&mut law.tangential, &mut law.normal] {
            *slot = place(*slot).expect("a block holds both coordinates of a contact");
        }
        law
    });
    let laws: Vec<_> = laws.collect();
    let rows: Vec<usize> =
        contacts.iter().flat_map(|&contact| [2 * contact, 2 * contact + 1]).collect();
    let whole = scene.coordinates.delassus.as_ref();
    let delassus = whole.map(|whole| whole.select_rows(&rows).select_columns(&rows));
    let matrix = |whole: &SparseMatrix| whole.restricted(&coordinates);
    let dependents = scene.dependents.iter().filter_map(|one| {
        let within = one.terms.iter().map(|&(k, factor)| Some((place(k)?, factor)));
        Some(Slaved {
            coordinate: place(one.coordinate)?,
            constant: one.constant,
            terms: within.collect::<Option<_>>()?,
        })
    });
    let [mass, damping, stiffness] = scene.matrices().map(matrix);
    let slots: Vec<(usize, usize)> = laws.iter().map(|law| (law.tangential, law.normal)).collect();
    let drive = scene.drive.as_ref().map(|drive| drive.restricted(&coordinates));
    let dofs = drive.as_ref().map_or(coordinates.len(), |drive| drive.structure);
    let massless = scene.massless.restricted(&coordinates, &contacts);
    let border = Terms { proportional: scene.felt(), structure: dofs, massless: &massless };
    let coupled_mass = coupled_mass(&mass, &damping, &stiffness, Some(border), &slots)
        .expect("a block of a positive definite mass");
    let friction = |all: &Arc<[Option<FrictionLaw>]>| {
        contacts.iter().map(|&contact| all[contact].clone()).collect()
    };
    let part = Scene {
        laws: scene.laws.as_ref().map(friction),
        states: None,
        elements: None,
        preload: None,
        dependents: SlavedCoordinates::new(dependents.collect()),
        size: coordinates.len(),
        dofs,
        nodes: None,
        massless,
        condensed: false,
        impact_friction: scene.impact_friction,
        coordinates: Coordinates::of_contacts(dofs, slots, delassus, scene.coordinates.oblique),
        contacts: laws,
        mass,
        coupled_mass,
        damping,
        proportional: scene.proportional,
        stiffness,
        energy_parts: scene.energy_parts.as_ref().map(|parts| EnergyParts {
            dissipative: matrix(&parts.dissipative),
            elastic: matrix(&parts.elastic),
            antisymmetric: matrix(&parts.antisymmetric),
        }),
        force: coordinates.iter().map(|&k| scene.force[k]).collect(),
        loads: Loads::default(),
        drive,
        bare,
    };
    Block { scene: Arc::new(part), coordinates, contacts }
}
