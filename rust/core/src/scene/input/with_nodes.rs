//! Dofs beside those that are stated: the nodes of compliant contacts have no mass, and forces that depend on rates of dofs
//! without mass are refused; the states of contacts have one.

use crate::error::input::Error;
use crate::linalg::sparse::{SparseMatrix, summed};
use crate::scene::friction::contact_state::ContactState;
use crate::scene::input::scene_input::Damping;
use crate::scene::input::validated::{HiddenDof, Validated};
use crate::scene::massless::coordinates::{Nodes, condensed_stiffness};

/// The scene with the node of every compliant contact as a further dof, which springs tie to the others.
pub(crate) fn with_nodes(stated: Validated) -> Result<(Nodes, Validated), Error> {
    let dofs = stated.force.len();
    let nodes = Nodes::new(dofs, &stated.contacts);
    let massless = (0..dofs).any(|dof| stated.lacks_mass(dof));
    let damping = match stated.damping {
        Damping::Proportional { mass: alpha, stiffness: beta }
            if (beta != 0.0 && (massless || !nodes.is_empty())) || !nodes.states.is_empty() =>
        {
            let felt = condensed_stiffness(&stated.mass, &stated.stiffness)?;
            Damping::General(stated.mass.combined(alpha, &felt, beta))
        }
        damping => damping,
    };
    let stated = Validated { damping, ..stated };
    if massless {
        check_rates(&stated)?;
    }
    let hidden = StateTerms::new(&nodes, &stated)?;
    let mut force = stated.force;
    force.resize(nodes.size, 0.0);
    force.iter_mut().zip(&hidden.force).for_each(|(force, own)| *force += own);
    let padded = |matrix: SparseMatrix| matrix.padded(nodes.size);
    let gyroscopic = match (stated.gyroscopic.map(padded), hidden.damping) {
        (Some(stated), Some(own)) => Some(stated.combined(1.0, &own, 1.0)),
        (stated, own) => stated.or(own),
    };
    let whole = Validated {
        mass: match hidden.mass {
            Some(own) => padded(stated.mass).combined(1.0, &own, 1.0),
            None => padded(stated.mass),
        },
        stiffness: nodes.with_springs(stated.stiffness),
        damping: match stated.damping {
            Damping::General(damping) => Damping::General(padded(damping)),
            proportional => proportional,
        },
        gyroscopic,
        circulatory: stated.circulatory.map(padded),
        force,
        contacts: nodes.contacts(&stated.contacts),
        hidden: hidden.contacts,
        hidden_force: hidden.force,
        ..stated
    };
    Ok((nodes, whole))
}

/// What states of contacts add over dofs and nodes; see [`crate::scene::friction::contact_state`].
#[derive(Default)]
struct StateTerms {
    contacts: Vec<HiddenDof>,
    mass: Option<SparseMatrix>,
    /// Of bristles: dampers along the contacts, and the skew-symmetric coupling of contacts and deflections.
    damping: Option<SparseMatrix>,
    force: Vec<f64>,
}

impl StateTerms {
    fn new(nodes: &Nodes, stated: &Validated) -> Result<Self, Error> {
        if nodes.states.is_empty() {
            return Ok(Self::default());
        }
        let mut masses = vec![0.0; nodes.size];
        let mut force = masses.clone();
        let mut rows: Vec<Vec<(usize, f64)>> = vec![Vec::new(); nodes.size];
        let mut contacts = Vec::new();
        for &(contact, dof) in &nodes.states {
            let law = &stated.contacts[contact];
            let (Some(state), Some(tangential)) = (&law.state, &law.tangential) else {
                continue;
            };
            let along = tangential.nonzero();
            let inverse = |&(k, entry): &(usize, f64)| entry * entry / stated.mass.get(k, k);
            let felt = 1.0 / along.iter().map(inverse).sum::<f64>();
            if !(felt > 0.0) {
                let reason =
                    "a slip without mass; give the dof mass, or leave tangential_stiffness out";
                return Err(Error::StateBeside { contact, reason });
            }
            masses[dof] = felt;
            contacts.push(HiddenDof { contact, dof, mass: felt });
            // Forces of bristles that can open are there while their contact is closed; a spring in a plane is relaxed where it is not.
            let ContactState::Bristles(bristles) = state else { continue };
            if law.normal.is_some() && !state.is_spring() {
                continue;
            }
            let scale = state.scale(law.normal_force, felt, law.slider_speed);
            let spring = law.normal_force * bristles.stiffness;
            let damper = law.normal_force * (bristles.damping + bristles.viscous);
            force[dof] = -spring / scale * law.slider_speed;
            for &(k, entry) in &along {
                force[k] += damper * law.slider_speed * entry;
                rows[k].extend(along.iter().map(|&(j, other)| (j, damper * entry * other)));
                rows[k].push((dof, spring / scale * entry));
                rows[dof].push((k, -spring / scale * entry));
            }
        }
        let damping = SparseMatrix::from_rows(nodes.size, |row, entries| {
            entries.append(&mut rows[row]);
            summed(entries);
        });
        let mass = Some(SparseMatrix::diagonal(&masses));
        Ok(Self { contacts, mass, damping: Some(damping), force })
    }
}

/// Refuses damping, gyroscopic and circulatory forces on dofs without mass, whose motion follows from forces alone.
fn check_rates(stated: &Validated) -> Result<(), Error> {
    let given = match &stated.damping {
        Damping::General(damping) => Some(damping),
        Damping::Proportional { .. } => None,
    };
    let matrices = [
        ("damping", given),
        ("gyroscopic", stated.gyroscopic.as_ref()),
        ("circulatory", stated.circulatory.as_ref()),
    ];
    for (argument, matrix) in matrices {
        let Some(matrix) = matrix else { continue };
        for row in 0..matrix.size() {
            for (column, _) in matrix.row(row).filter(|entry| entry.1 != 0.0) {
                if let Some(dof) = [row, column].into_iter().find(|&dof| stated.lacks_mass(dof)) {
                    return Err(Error::RateWithoutMass { argument, dof });
                }
            }
        }
    }
    Ok(())
}
